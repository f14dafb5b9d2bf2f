"""What of a cutting record does not repeat with the spindle: its spectrum window by window, and its peaks.

The record is brought to even angles. What repeats with every revolution, and the linear change of that along
the record, is taken out phase by phase: that takes out all orders of the **spindle**, since runout lives at
those that are none of the teeth's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from metro.units import Array

LEAST_REVOLUTIONS, MOST_REVOLUTIONS = 20, 60  # of a window
WINDOWS = 3  # of a record, at least: the longer each is, the nearer to an order it sees a line
SIGNIFICANCE = 1e-3  # of a peak, over all bins of a window
LOWEST_HZ = 5.0  # of the modes of robots
_WANDER = 2e-3  # relative error of speed within a window, that widens what counts as on an order
_NEIGHBOURS = 1.0  # orders, over which the noise floor is read: it follows what rings in an instrument
_BAND = 0.3  # of the sampling rate, up to which the record is true
_LEAK = 1  # bins to either side into which a line at a bin spreads in a Hann window; between bins, twice that


@dataclass(frozen=True, eq=False)
class Windows:
    """Spectra of a record over windows of whole revolutions, half overlapping; bin b is order b/revolutions.

    Attributes
    ----------
    revolutions : of a window.
    speed : mean, rev/s.
    order : (b,) of the spindle.
    on_order : (b,) whether a bin is indistinguishable from an order of the spindle, or is not looked at.
    residual, periodic, whole : (w, b) power of the part that does not repeat, of the part that does, and of
        both together, over all channels, weighted like a displacement.
    floor : (w, b) noise floor of ``residual``.
    p_value : (w, b) probability that noise alone makes as much as ``residual``.
    asynchronous : (revolutions of the record, samples per revolution, channels) what does not repeat.
    time : (samples,) s, of these samples.
    """

    revolutions: int
    speed: float
    order: Array
    on_order: np.ndarray
    residual: Array
    periodic: Array
    whole: Array
    floor: Array
    p_value: Array
    asynchronous: Array
    time: Array

    @property
    def peaks(self) -> np.ndarray:
        """Return where (w, b) the residual is significant, at no order of the spindle and not beside one."""
        tests = max(int(np.count_nonzero(~self.on_order)), 1)
        beside = _highest(np.where(self.on_order, self.residual, 0.0), 2 * _LEAK)
        return np.asarray((self.p_value < SIGNIFICANCE / tests) & ~self.on_order & (self.residual > beside))

    @property
    def energy_ratio(self) -> Array:
        """Share (w,) of the peaks' energy in that of peaks and periodic part together."""
        around = (_highest(self.peaks.astype(float), _LEAK) > 0.0) & ~self.on_order
        energy = np.where(around, np.maximum(self.residual - self.floor, 0.0), 0.0).sum(axis=1)
        total = energy + self.periodic[:, np.round(self.order) > 0.0].sum(axis=1)
        return np.asarray(energy / np.where(total > 0.0, total, 1.0))


def windows(time: Array, angle: Array, signal: Array, *, differentiated: int = 0) -> Windows:
    """Part the record of a steady cut into what repeats with the spindle and the residual, window by window.

    Parameters
    ----------
    time, angle : (n,) s; rad, of the spindle. signal : (n, channels).
    differentiated : how often the signal is the derivative of a displacement: 2 for an acceleration, 0 for a
        displacement or a force, which follows the thickness of the chip.

    Raises
    ------
    ValueError
        If the record is shorter than three windows of twenty revolutions, half overlapping.
    """
    even = over_angle(time, angle, signal)
    length, starts = _cut(len(even))
    speed, order, looked_at, on_order = _axis(time, angle, even.shape[1], length)
    repeated = _repeated(even)
    residual, periodic, whole = (
        np.stack([power_of(part[start : start + length], len(order)) for start in starts])
        for part in (even - repeated, repeated, even)
    )
    floor = _floor(residual, on_order, length)
    weight = looked_at * np.where(looked_at, order, 1.0) ** (-2.0 * differentiated)
    return Windows(
        length,
        speed,
        order,
        on_order,
        residual=residual.sum(axis=2) * weight,
        periodic=periodic.sum(axis=2) * weight,
        whole=whole.sum(axis=2) * weight,
        floor=floor.sum(axis=2) * weight,
        p_value=_p_value(residual, floor),
        asynchronous=even - repeated,
        time=even_times(time, angle),
    )


def whole_spectrum(time: Array, angle: Array, signal: Array) -> tuple[Array, Array, np.ndarray]:
    """Frequencies (b,), Hz, amplitudes of sines (b,), all channels together, and which are on orders (b,).

    Of the whole record, (n,) s, (n,) rad and (n, channels), as the detection sees it: over even angles.
    """
    even = over_angle(time, angle, signal)
    speed, order, _, on_order = _axis(time, angle, even.shape[1], len(even))
    power = power_of(even, len(order)).sum(axis=1)
    # a Hann taper spreads the power of a sine over bins of which the highest has two thirds
    return order * speed, np.sqrt(2.0 * 1.5 * power), on_order


def over_angle(time: Array, angle: Array, signal: Array) -> Array:
    """Whole revolutions of a record at even angles, (revolutions, samples per revolution, channels)."""
    from scipy.interpolate import CubicSpline

    when = even_times(time, angle)
    per_turn = _per_turn(time, angle)
    return np.asarray(CubicSpline(time, signal)(when).reshape(len(when) // per_turn, per_turn, -1))


def even_times(time: Array, angle: Array) -> Array:
    """Return times (samples,), s, of even angles over the whole revolutions of a record."""
    turns = (angle - angle[0]) / (2.0 * math.pi)
    count, per_turn = int(turns[-1] + 1.0 / len(turns)), _per_turn(time, angle)
    return np.asarray(np.interp(np.arange(count * per_turn) / per_turn, turns, time))


def _per_turn(time: Array, angle: Array) -> int:
    """Return the samples per revolution of a record, as a whole number."""
    return max(8, round((len(time) - 1) * 2.0 * math.pi / float(angle[-1] - angle[0])))


def _axis(
    time: Array, angle: Array, per_turn: int, length: int
) -> tuple[float, Array, np.ndarray, np.ndarray]:
    """Speed, rev/s; orders (b,) of a window's bins; which are looked at, and which lie on an order."""
    speed = float((angle[-1] - angle[0]) / (2.0 * math.pi * (time[-1] - time[0])))
    rate = (len(time) - 1) / (time[-1] - time[0])
    order = np.arange(int(min(_BAND * rate / speed, 0.5 * per_turn) * length) + 1) / length
    looked_at = order >= max(3.0 / length, LOWEST_HZ / speed)
    nearest = np.round(order)
    return (
        speed,
        order,
        looked_at,
        ~looked_at | (np.abs(order - nearest) <= 1.001 / length + _WANDER * nearest),
    )


def _cut(revolutions: int) -> tuple[int, np.ndarray]:
    """Length and starts of the windows, in revolutions."""
    least = LEAST_REVOLUTIONS * (WINDOWS + 1) // 2
    if revolutions < least:
        raise ValueError(f"{revolutions} revolutions of steady cut: at least {least} are needed")
    length = int(np.clip(2 * revolutions // (WINDOWS + 1), LEAST_REVOLUTIONS, MOST_REVOLUTIONS))
    count = round(2 * revolutions / length) - 1
    return length, np.linspace(0, revolutions - length, count).round().astype(int)


def _repeated(even: Array) -> Array:
    """Return what each phase of the revolution repeats, with its linear change from turn to turn."""
    turn = np.arange(len(even)) - 0.5 * (len(even) - 1)
    slope = np.tensordot(turn, even, axes=(0, 0)) / float(turn @ turn)
    return np.asarray(even.mean(axis=0) + turn[:, None, None] * slope)


def power_of(part: Array, bins: int) -> Array:
    """Mean-square spectrum (bins, channels) of a window, by a Hann taper."""
    flat = part.reshape(-1, part.shape[2])
    taper = 0.5 - 0.5 * np.cos(2.0 * math.pi * (np.arange(len(flat)) + 0.5) / len(flat))
    spectrum = np.fft.rfft((flat - flat.mean(axis=0)) * taper[:, None], axis=0)[:bins]
    return np.asarray(2.0 * np.abs(spectrum) ** 2 / (len(flat) * float(taper @ taper)))


def _floor(residual: Array, on_order: np.ndarray, length: int) -> Array:
    """Noise floor (w, b, channels): median of the neighbouring bins between the orders, as a mean of noise.

    Sensors get noisier towards low frequencies: below the first order the floor is taken to rise as 1/f.
    """
    from scipy.ndimage import median_filter

    free = np.flatnonzero(~on_order)
    size = int(_NEIGHBOURS * length) | 1
    # one spectrum at a time: for one dimension SciPy has a median whose cost hardly grows with the size
    each = np.moveaxis(residual[:, free], 1, 2).reshape(-1, len(free))
    median = np.array([median_filter(one, size, mode="reflect") for one in each])
    level = np.moveaxis(median.reshape(len(residual), -1, len(free)), 2, 1) / math.log(2.0)
    place = np.clip(np.searchsorted(free, np.arange(len(on_order))), 0, len(free) - 1)
    rise = np.maximum(length / np.maximum(np.arange(len(on_order)), 1), 1.0)
    return np.asarray(np.maximum(level[:, place] * rise[:, None], 1e-12 * residual.max()))


def _p_value(residual: Array, floor: Array) -> Array:
    """Probability (w, b) of as much power in all channels together, each exponential about its floor."""
    from scipy.special import gammaincc

    return np.asarray(gammaincc(residual.shape[2], (residual / floor).sum(axis=2)))


def _highest(power: Array, reach: int) -> Array:
    """Highest power (w, b) within some bins."""
    from scipy.ndimage import maximum_filter1d

    return np.asarray(maximum_filter1d(power, 2 * reach + 1, axis=1))
