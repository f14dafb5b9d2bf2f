"""Two logs of one motion, brought together in time, so that their torques can be subtracted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.robot.joint_dynamics import cutoff
from metro.robot.motion import BANDWIDTH, EDGE, PER_PERIOD, STEPS, encoder_step, even_clock, rate_noise
from metro.units import Array

SAME = 0.01  # rms of the difference of the angles, over that of the angles: the tracking of two repeats
LEAST_OVERLAP = 0.5  # of the shorter log


@dataclass(frozen=True, eq=False)
class Pair:
    """Two logs of one motion at the same m places, low-passed alike; (m, n) each, rad, N m.

    Attributes
    ----------
    angle, rate, acceleration : of the second log. direction : sign of its speed, filtered as the torques.
    first, second : torques. moving : (m, n) bool, away
        from where a joint turns round. shift : s, by which the second log's clock is ahead.
    apart : (n,) rms of the difference of the angles, rad.
    """

    angle: Array
    rate: Array
    acceleration: Array
    direction: Array
    first: Array
    second: Array
    moving: np.ndarray
    shift: float
    apart: Array


Log = tuple[Array, Array, Array]  # time (m,), angles (m, n), torques (m, n)


def pair_of(first: Log, second: Log) -> Pair | None:
    """Return two logs of one motion at the same places; None where their motions are not the same.

    The shift of their clocks is that with the least difference of the angles.
    """
    from scipy.signal import butter, sosfiltfilt

    period = max(even_clock(first[0])[1], even_clock(second[0])[1])
    one, other = (_even(log, period) for log in (first, second))
    n = first[1].shape[1]
    lag = _lag(one[:, :n], other[:, :n])
    if lag is None:
        return None
    start = max(0, -lag)
    stop = min(len(one), len(other) - lag)
    at = np.arange(start, stop)
    fine = _fine(one[at, :n], other[:, :n], at + lag)
    moved = np.array([np.interp(at + lag + fine, np.arange(len(other)), column) for column in other.T]).T
    apart = np.sqrt(np.mean((moved[:, :n] - one[at, :n]) ** 2, axis=0))
    if np.linalg.norm(apart) > SAME * np.linalg.norm(one[at, :n].std(axis=0)):
        return None
    low = min(cutoff(*first[:2]), BANDWIDTH / period)
    filter_ = butter(4, low, fs=1 / period, output="sos")

    def smooth(values: Array) -> Array:
        return np.asarray(sosfiltfilt(filter_, values, axis=0))

    angle = smooth(moved[:, :n])
    rate = np.gradient(angle, period, axis=0)
    slowest = STEPS * rate_noise(encoder_step(second[1]), period, low)
    direction = smooth(np.clip(rate / slowest, -1.0, 1.0))
    edge = min(int(EDGE / (low * period)), len(at) // 4)
    keep = slice(edge, len(at) - edge, max(1, int(1 / PER_PERIOD / (low * period))))
    return Pair(
        angle[keep],
        rate[keep],
        np.gradient(rate, period, axis=0)[keep],
        direction[keep],
        smooth(one[at, n:])[keep],
        smooth(moved[:, n:])[keep],
        _settled((np.abs(rate) > slowest)[keep] & (_same_way(rate, keep))),
        float((lag + fine) * period),
        apart,
    )


def _same_way(rate: Array, keep: slice) -> np.ndarray:
    """Return where a joint, (m, n), turns as it did at the sample that is kept before."""
    way = np.sign(rate[keep])
    return np.vstack([np.ones((1, way.shape[1]), dtype=bool), way[1:] == way[:-1]])


def _settled(moving: np.ndarray) -> np.ndarray:
    """Leave out what lies within half a period of the filter from where a joint turns round.

    Two logs sample the step of its friction there at other instants, and the filter spreads the difference.
    """
    from scipy.ndimage import binary_erosion

    around = np.ones((2 * (PER_PERIOD // 2) + 1, 1), dtype=bool)
    return np.asarray(binary_erosion(moving, around, border_value=1))


def _even(log: Log, period: float) -> Array:
    """Angles and torques (m', 2 n) at even times."""
    even = np.arange(log[0][0], log[0][-1], period)
    return np.array([np.interp(even, log[0], column) for column in (*log[1].T, *log[2].T)]).T


def _lag(one: Array, other: Array) -> int | None:
    """Return the number of samples by which the second is ahead, by the least mean square difference."""
    size = len(one) + len(other) - 1
    least = LEAST_OVERLAP * min(len(one), len(other))

    def spectrum(values: Array) -> np.ndarray:
        return np.fft.rfft(values, size, axis=0)

    middle = one.mean(axis=0)
    one, other = one - middle, other - middle
    ones, others = np.ones((len(one), 1)), np.ones((len(other), 1))
    # Σ (a_i − b_(i + lag))², expanded into three correlations
    cross = np.conj(spectrum(one)) * spectrum(other)
    square = np.conj(spectrum(one**2)) * spectrum(others) + np.conj(spectrum(ones)) * spectrum(other**2)
    total = np.fft.irfft((square - 2.0 * cross).sum(axis=1), size)
    count = np.fft.irfft((np.conj(spectrum(ones)) * spectrum(others))[:, 0], size)
    mean = np.where(count >= least, total / np.maximum(count, 1.0), np.inf)
    at = int(np.argmin(mean))
    if not np.isfinite(mean[at]):
        return None
    return at if at < len(other) else at - size


def _fine(one: Array, other: Array, at: np.ndarray) -> float:
    """Return the part of a sample by which the second is ahead still: one step of Gauss and Newton, twice."""
    shift = 0.0
    index = np.arange(len(other))
    for _ in range(2):
        moved = np.array([np.interp(at + shift, index, column) for column in other.T]).T
        slope = np.gradient(moved, axis=0)
        shift += float(np.sum(slope * (one - moved)) / np.sum(slope**2))
    return shift
