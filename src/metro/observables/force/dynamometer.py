"""The response of a dynamometer to the force on the tool: wrong axes, resonance, drift, and leaking charge.

It is computed in the order domain and in the frame of the comparison. In helical milling this frame turns
with the orbit and the sensor does not, so the sensor's matrix is averaged over the turn within a time block.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from metro.units import Array, ComplexArray

ORBIT_POINTS = 5  # within a time block, over which the turning frame is averaged
Triple = tuple[float, float, float]
Rows = tuple[tuple[float, ...], ...]
WORK_AXES: Rows = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Resonance:
    """A resonance of one degree of freedom on each channel: frequency, Hz (infinite: rigid), and damping."""

    frequency: Triple
    damping: Triple


@dataclass(frozen=True)
class Dynamometer:
    """A sensor (SI): its deviations from what the manifest declares.

    Attributes
    ----------
    axes : declared rows that turn the force on the tool, work frame, into the channels (reversed if the
        sensor reads the force on the work).
    rotation : of the sensor about +z against the declared, rad.
    resonances : in series; none: rigid.
    slope : drift of each channel, N/s.
    discharge : reciprocal time constant of each channel's charge, 1/s.
    """

    axes: Rows = WORK_AXES
    rotation: float = 0.0
    resonances: tuple[Resonance, ...] = ()
    slope: Triple = (0.0, 0.0, 0.0)
    discharge: Triple = (0.0, 0.0, 0.0)

    @property
    def ideal(self) -> bool:
        """Whether it reads the force as it is, but for a drift."""
        return not self.resonances and self.rotation == 0.0 and not any(self.discharge)

    @property
    def drift(self) -> Array:
        """Drift of the force on the tool that it reads, work frame, (3,) N/s."""
        return np.asarray(np.linalg.inv(np.array(self.axes)) @ np.array(self.slope))


@dataclass(frozen=True)
class Recording:
    """When and how a run was recorded, in s from the record's start, rev/s and rad/s.

    ``middles`` and ``span`` of the time blocks; ``zero_at``: time at which the zero was read; ``contact``:
    start of the cut; ``speed`` of the tool against the feed; ``orbit``: rate at which the frame turns.
    """

    middles: tuple[float, ...]
    span: float
    speed: float
    orbit: float = 0.0
    zero_at: float = 0.0
    contact: float = 0.0

    @property
    def attenuation(self) -> float:
        """Remaining share of a constant vector, averaged over a block in the turning frame."""
        return float(np.sinc(self.orbit * self.span / (2.0 * math.pi)))


def read(sensor: Dynamometer, recording: Recording, orders: Array) -> Array:
    """Order coefficients that the sensor reads of those of the force: (2H+1, 3, k) → (blocks, 2H+1, 3, k)."""
    force = _complex(orders)
    return _real(_transfer(sensor, recording, len(force)) @ force)


@lru_cache(maxsize=512)
def _transfer(sensor: Dynamometer, recording: Recording, orders: int) -> ComplexArray:
    """Map of the force to the reading, in the frame of the comparison, (blocks, orders, 3, 3)."""
    blocks = []
    for middle in recording.middles:
        matrix = _matrix(sensor, recording, middle, orders)
        matrix[0] = _steady(sensor, recording, middle)
        blocks.append(matrix)
    return np.stack(blocks)


def _complex(orders: Array) -> ComplexArray:
    """Amplitudes of e^{+ikα}, (H+1, …), of coefficients [mean, cosine, sine, …]."""
    return np.concatenate([orders[:1].astype(complex), orders[1::2] - 1j * orders[2::2]])


def _real(amplitudes: ComplexArray) -> Array:
    """Undo :func:`_complex` in every block, (blocks, H+1, …)."""
    blocks, count = amplitudes.shape[:2]
    orders = np.empty((blocks, 2 * count - 1, *amplitudes.shape[2:]))
    orders[:, 0] = amplitudes[:, 0].real
    orders[:, 1::2], orders[:, 2::2] = amplitudes[:, 1:].real, -amplitudes[:, 1:].imag
    return orders


def _rows(sensor: Dynamometer) -> tuple[Array, Array]:
    """Return the declared channels, and the channels with the sensor's rotation."""
    c, s = math.cos(sensor.rotation), math.sin(sensor.rotation)
    declared = np.array(sensor.axes)
    return declared, declared @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def _turn(angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _gain(sensor: Dynamometer, speed: float, orders: int) -> ComplexArray:
    """Response of each channel at the orders 0…, (orders, 3): the product of those of its resonances."""
    gain = np.ones((orders, 3), complex)
    for one in sensor.resonances:
        ratio = speed * np.arange(orders)[:, None] / np.array(one.frequency)
        gain = gain * (1.0 / (1.0 - ratio**2 + 2j * np.array(one.damping) * ratio))
    return gain


def _matrix(sensor: Dynamometer, recording: Recording, middle: float, orders: int) -> ComplexArray:
    """Map of the force to the reading, in the frame of the comparison, by order: (orders, 3, 3)."""
    declared, true = _rows(sensor)
    back = np.linalg.inv(declared)
    gain = _gain(sensor, recording.speed, orders)
    points = ORBIT_POINTS if recording.orbit else 1
    shares = (np.arange(points) + 0.5) / points - 0.5
    total = np.zeros((orders, 3, 3), complex)
    for share in shares:
        turn = _turn(recording.orbit * (middle + share * recording.span))
        total += np.einsum("ic,hc,cj->hij", turn.T @ back, gain, true @ turn) / points
    return total


def _steady(sensor: Dynamometer, recording: Recording, middle: float) -> Array:
    """Map (3, 3) of the mean force to its reading while the charge leaks away.

    A channel with discharge rate 1/τ reads y' = F' − y/τ, y = 0 before the contact. A force that turns with
    the orbit is the real part of a complex one times e^{iωt}.
    """
    declared, true = _rows(sensor)
    orbit, since = recording.orbit, middle - recording.contact
    rows = np.empty((3, 3))
    for channel, (direction, rate) in enumerate(zip(true, sensor.discharge, strict=True)):
        plane = complex(direction[0], -direction[1]) * cmath.exp(1j * orbit * recording.contact)
        turning = _leaked(rate, orbit, since)
        rows[channel] = (
            (plane * turning).real,
            (1j * plane * turning).real,
            direction[2] * _leaked(rate, 0.0, since).real,
        )
    return np.asarray(_turn(orbit * middle).T @ np.linalg.inv(declared) @ rows)


def _leaked(rate: float, orbit: float, since: float) -> complex:
    """Return the remaining part of e^{iωt}, applied from t = 0 on, after a discharge at ``rate``."""
    if rate == 0.0:
        return cmath.exp(1j * orbit * since)
    moving = 1j * orbit * cmath.exp(1j * orbit * since)
    return (moving + rate * math.exp(-rate * since)) / (1j * orbit + rate)
