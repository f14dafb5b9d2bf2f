"""What sensors read, in the axes and units of the contract: forces on the tool, responses and FRFs in SI."""

from __future__ import annotations

from typing import Literal

import numpy as np

from metro.units import DEG, Array, ComplexArray

STANDARD_GRAVITY = 9.80665

# unit of a response → its factor to SI, and how often its receptance was differentiated in time
_RESPONSES = {"m": (1.0, 0), "m/s": (1.0, 1), "m/s2": (1.0, 2), "g": (STANDARD_GRAVITY, 2)}


def sensor_to_tool(axes: Array, rotation_deg: float, reads: Literal["work", "tool"]) -> Array:
    """Return the (3, 3) matrix that takes a dynamometer's readings to the force on the tool, work frame.

    A reading is a vector of components along the sensor's axes; column k of ``axes`` (3, 3) is the work-frame
    direction of sensor axis k. The sensor is then turned counter-clockwise about work +z:
    ``f_work = R_z axes f_sensor``. A dynamometer under the work reads the opposite of the force on the tool.
    """
    angle = rotation_deg * DEG
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    sign = {"work": -1.0, "tool": 1.0}[reads]
    return np.asarray(sign * turn @ axes)


def response_si(response: Array, unit: str) -> Array:
    """Convert a recorded response from ``unit`` (m, m/s, m/s2 or g) to SI of the same quantity."""
    return response * _RESPONSES[unit][0]


def receptance(frequency_hz: Array, frf: ComplexArray, unit: str) -> ComplexArray:
    """Convert an FRF of ``unit`` per newton (m, m/s, m/s2 or g) to receptance, m/N, convention e^{+iωt}.

    A mobility is divided by iω and an accelerance by (iω)²; their line at 0 Hz has no receptance and is NaN.
    """
    factor, order = _RESPONSES[unit]
    if order == 0:
        return factor * frf
    converted = np.full(frf.shape, np.nan, np.complex128)
    moving = frequency_hz != 0.0
    converted[moving] = factor * frf[moving] / (2.0j * np.pi * frequency_hz[moving]) ** order
    return converted


def driving_point_sign(frequency_hz: Array, frf: ComplexArray) -> float:
    """Return Σ ω Im H / Σ ω |H| of a driving point's receptance, in −1…1.

    The power that a force puts into a structure at its own point is F² ω (−Im H)/2 and cannot be negative, so
    the value is negative in the convention e^{+iωt} and positive where an FRF is conjugated. The weight ω
    keeps the noise of an integrated acceleration at the lowest lines from deciding.
    """
    scale = float(np.sum(frequency_hz * np.abs(frf)))
    return float(np.sum(frequency_hz * frf.imag)) / scale if scale > 0.0 else 0.0


def moved(points: Array, transform: Array) -> Array:
    """Apply a (4, 4) rigid transform to points (n, 3), in the transform's unit of length."""
    return np.asarray(points @ transform[:3, :3].T + transform[:3, 3])
