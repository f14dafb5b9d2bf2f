"""What a piezoelectric dynamometer makes of a force: axes, resonance, drift, noise, range, resolution."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from virtual_cell.noise import quantised, sensor_noise
from virtual_cell.units import Array

# Computed twice as fast as recorded, then low-passed; a margin on both sides settles the filters.
_OVERSAMPLE = 2
_MARGIN = 0.02  # s


@dataclass(frozen=True)
class Dynamometer:
    """The instrument as it really is.

    Attributes
    ----------
    rate : Hz. reads : force on the ``work`` or on the ``tool``.
    axes : (3, 3), row i the direction of sensor axis i in the work frame; then turned by ``rotation`` (rad,
        about +z).
    noise, offset : standard deviations of the noise and of the zero of a run, N. capacity, step : range,
        resolution, N.
    resonance : per axis (Hz, damping) or None. slope : drift per axis, N/s. time_constant : s, or None: no
        discharge. lag : (3,) time constant of the amplifier on each axis, s.
    """

    rate: float
    reads: str
    axes: Array
    noise: float
    rotation: float = 0.0
    offset: float = 1.0
    capacity: float = 5000.0
    step: float = 0.05
    resonance: tuple[tuple[float, float] | None, ...] = (None, None, None)
    slope: tuple[float, float, float] = (0.0, 0.0, 0.0)
    time_constant: tuple[float, float, float] | None = None
    lag: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def rows(self) -> Array:
        """Directions of the real sensor axes in the work frame, (3, 3)."""
        c, s = math.cos(self.rotation), math.sin(self.rotation)
        turned: Array = self.axes @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        return turned


def record(
    sensor: Dynamometer, force: Callable[[Array], Array], duration: float, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Return times (n,), s, and readings (n, 3), N, of a force on the tool given in the work frame."""
    fine = sensor.rate * _OVERSAMPLE
    margin = math.ceil(_MARGIN * sensor.rate) * _OVERSAMPLE
    count = round(duration * sensor.rate)
    t = (np.arange(count * _OVERSAMPLE + 2 * margin) - margin) / fine
    load = force(t) @ sensor.rows.T * (-1.0 if sensor.reads == "work" else 1.0)
    read = np.stack([_axis(sensor, axis, load[:, axis], fine) for axis in range(3)], axis=1)
    keep = slice(margin // _OVERSAMPLE, margin // _OVERSAMPLE + count)
    time = np.arange(count) / sensor.rate
    read = read[keep] + np.outer(time, sensor.slope) + sensor.offset * rng.standard_normal(3)
    read += np.stack([sensor_noise(count, sensor.noise, rng) for _ in range(3)], axis=1)
    return time, quantised(np.clip(read, -sensor.capacity, sensor.capacity), sensor.step)


def _axis(sensor: Dynamometer, axis: int, load: Array, fine: float) -> Array:
    """Dynamics of one axis, and the anti-alias filter on the way to the recorded rate."""
    from scipy import signal

    mode = sensor.resonance[axis]
    if mode is not None:
        omega, zeta = 2.0 * math.pi * mode[0], mode[1]
        load = _through(([omega**2], [1.0, 2.0 * zeta * omega, omega**2]), load, fine)
    if sensor.time_constant is not None:
        tau = sensor.time_constant[axis]
        load = _through(([tau, 0.0], [tau, 1.0]), load, fine)
    if sensor.lag[axis] > 0.0:
        load = _through(([1.0], [sensor.lag[axis], 1.0]), load, fine)
    slow: Array = signal.resample_poly(load, 1, _OVERSAMPLE, padtype="line")
    return slow


def _through(system: tuple[list[float], list[float]], load: Array, rate: float) -> Array:
    """Response of a linear system at rest to a load that is linear between samples."""
    from scipy import signal

    num, den, _ = signal.cont2discrete(system, 1.0 / rate, method="foh")
    out: Array = signal.lfilter(np.ravel(num), den, load)
    return out
