"""What distinguishes chatter from other vibrations: its line, side bands, growth, Poincaré section, kind."""

from __future__ import annotations

import math

import numpy as np

from metro.signals.asynchronous import Windows, power_of
from metro.units import Array

GROWTH = 4.0  # of an energy, from the first window to the last
RING = 0.35  # scatter of an amplitude: 0.52 for noise in a narrow band, 0 on a closed curve
SIDE_BANDS = 2  # of the four nearest, at least
FINEST = 0.05  # of a bin: what the place of a peak between bins is worth
LOW_HZ = (5.0, 300.0)  # where the modes of robots are
LOW_RUNS, LOW_SPEEDS, LOW_SCATTER = 3, 1.2, 0.01  # runs, ratio of their speeds, relative scatter of frequency
_WITHIN, _ABOUT = 2, 0.3  # bins about a line that are its own; orders about it that are compared
_BLOCK = 5  # revolutions over which an amplitude is read
_NEAR = 2  # bins about the mean line in which it is sought in each window
_LOCKED = 0.5  # of all energy on one order that is none of the teeth's
_MIXED = 0.03  # of that energy, at the orders that it makes with itself and the teeth


def line(seen: Windows) -> Array:
    """Order (w,) of the strongest line between the spindle's orders in each window; NaN where there is none.

    It is the one that is strongest over all windows, followed through them.
    """
    energy = np.where(seen.peaks, seen.residual, 0.0)
    order = np.full(len(energy), math.nan)
    place = int(np.argmax(energy.sum(axis=0)))
    near = np.arange(max(place - _NEAR, 1), min(place + _NEAR + 1, energy.shape[1] - 1))
    for window in np.flatnonzero(energy[:, near].any(axis=1)):
        top = int(near[np.argmax(energy[window, near])])
        order[window] = (top + _between(seen.residual[window, top - 1 : top + 2])) / seen.revolutions
    return order


def _between(power: Array) -> float:
    """Place of a peak between three bins, from the parabola through the logarithms of their power."""
    left, middle, right = np.log(np.maximum(power, 1e-12 * power.max()))
    bend = left - 2.0 * middle + right
    return float(np.clip(0.5 * (left - right) / bend, -0.5, 0.5)) if bend < 0.0 else 0.0


def side_bands(seen: Windows, order: Array, teeth: int) -> np.ndarray:
    """Whether there are peaks one and two tooth passings beside the line, in each window (w,)."""
    beside = np.zeros(len(order), dtype=int)
    for passings in (-2, -1, 1, 2):
        place = np.rint(np.abs(order + passings * teeth) * seen.revolutions)
        inside = np.isfinite(place) & (place >= 1) & (place < len(seen.order) - 1)
        for window in np.flatnonzero(inside):
            at = int(place[window])
            beside[window] += bool(seen.peaks[window, at - 1 : at + 2].any())
    return beside >= SIDE_BANDS


def growing(seen: Windows) -> bool:
    """Whether the energy of the peaks rises all along, by a factor of four at least."""
    energy = np.where(seen.peaks, seen.residual, 0.0).sum(axis=1)
    return _rises(energy)


def _rises(energy: Array) -> bool:
    return bool(energy[-1] > GROWTH * energy[0] and np.all(np.diff(energy) > -0.1 * energy[-1]))


def amplitude_scatter(seen: Windows, order: float) -> float:
    """Relative scatter of the amplitude at an order, from block to block of five revolutions.

    A vibration that feeds itself runs on a closed curve of the Poincaré section, at one amplitude (or one
    that grows steadily: the trend of its logarithm is left out); noise in a narrow band fills a disc.
    """
    flat = seen.asynchronous.reshape(-1, seen.asynchronous.shape[2])
    phase = np.exp(-2j * math.pi * order * np.arange(len(flat)) / seen.asynchronous.shape[1])
    blocks = len(seen.asynchronous) // _BLOCK
    samples = _BLOCK * seen.asynchronous.shape[1]
    taper = np.hanning(samples)[:, None]
    turned = (flat * phase[:, None])[: blocks * samples].reshape(blocks, samples, -1)
    amplitude = np.sqrt((np.abs((turned * taper).sum(axis=1)) ** 2).sum(axis=1))
    logarithm = np.log(np.maximum(amplitude, 1e-12 * amplitude.max()))
    step = np.arange(blocks) - 0.5 * (blocks - 1)
    steady = amplitude * np.exp(-step * float(step @ logarithm) / float(step @ step))
    return float(steady.std() / steady.mean())


def kept_frequency(seen: Windows, order: Array) -> tuple[float, float]:
    """Frequency of the line over the whole record, Hz, and the share of the energy near it that is in it.

    A vibration that feeds itself keeps its frequency; a mode shaken by noise fills its own bandwidth. Without
    a line the frequency is NaN and the share 0.
    """
    from scipy.interpolate import CubicSpline

    if not np.isfinite(order).any():
        return math.nan, 0.0
    turns, per_turn, channels = seen.asynchronous.shape
    # over even times: where the speed wanders, chatter keeps its frequency rather than its order
    even = np.linspace(seen.time[0], seen.time[-1], turns * per_turn)
    flat = CubicSpline(seen.time, seen.asynchronous.reshape(-1, channels))(even)
    power = power_of(flat[None], turns * per_turn // 2).sum(axis=1)
    middle, near = round(float(np.nanmean(order)) * turns), round(0.5 * _ABOUT * turns)
    first = max(middle - near, 1)
    top = first + int(np.argmax(power[first : middle + near + 1]))
    own, about = (
        power[max(top - reach, 0) : top + reach + 1].sum() for reach in (_WITHIN, round(_ABOUT * turns))
    )
    at = top + _between(power[top - 1 : top + 2])
    return at / (float(even[1] - even[0]) * len(even)), float(own / about)


def locked(seen: Windows, teeth: int) -> bool:
    """Whether something other than runout may vibrate at orders of the spindle that are none of the teeth's.

    It does where the energy there has grown; or where one order carries half of all, is not the first, which
    runout excites most, and mixes with itself and the teeth, as no ringing of an instrument does. By its
    frequency alone it is confounded with runout or uneven teeth.
    """
    nearest = np.round(seen.order).astype(int)
    on = seen.on_order & (nearest > 0)
    energy = np.stack([np.bincount(nearest[on], power[on]) for power in seen.whole])
    number = np.arange(energy.shape[1])
    others = number % teeth != 0
    other = energy[:, others]
    grown = _rises(other.sum(axis=1)) and other[-1].sum() > _LOCKED * energy[-1].sum()
    total, whole = np.where(others, energy.sum(axis=0), 0.0), float(energy.sum())
    top = int(total.argmax())
    mixed = {2 * top, top + teeth, abs(top - teeth)} - {1, top}
    mixes = sum(total[k] for k in mixed if k < len(total)) > _MIXED * total[top]
    single = top > 1 and total[top] > _LOCKED * whole and mixes
    return bool(grown or single)


def kind_of(order: float, teeth: int, width: float) -> str:
    """Bifurcation that a chatter frequency, as an order of the spindle, indicates: "flip" or "hopf".

    A flip repeats after two tooth passings: it lies half-way between the orders of the teeth, to within
    ``width`` (orders).
    """
    return "flip" if abs(abs(order / teeth % 1.0) - 0.5) * teeth <= width else "hopf"


def at_a_robot_mode(chatter_hz: Array, rpm: Array, mode_hz: Array, damping: Array) -> np.ndarray:
    """Whether runs (n,) chattered in a mode of the robot whatever the speed, as mode coupling does.

    Regenerative chatter follows the speed of the spindle along each lobe. To distinguish the two takes
    several runs: three at least, their speeds a fifth apart, and all within a hundredth of one frequency,
    which lies within the half-power band of a mode between 5 and 300 Hz.

    Parameters
    ----------
    chatter_hz : (n,) Hz; NaN where a run did not chatter. rpm : (n,) speeds. mode_hz, damping : (m,).
    """
    matches = np.zeros(len(chatter_hz), dtype=bool)
    for frequency, zeta in zip(mode_hz, damping, strict=True):
        if not LOW_HZ[0] <= frequency <= LOW_HZ[1]:
            continue
        near = np.abs(chatter_hz - frequency) <= zeta * frequency
        if np.count_nonzero(near) < LOW_RUNS or rpm[near].max() < LOW_SPEEDS * rpm[near].min():
            continue
        if chatter_hz[near].std() <= LOW_SCATTER * frequency:
            matches |= near
    return matches
