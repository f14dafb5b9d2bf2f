"""Where a channel was cut off at the end of its range: flat tops that neither steps nor rest explain."""

from __future__ import annotations

import numpy as np

from metro.units import Array

FLAT_TOP_SAMPLES = 5
# A sine cut off at half its height, with runs of 5 samples, has a period of 15 samples or more; between two
# samples its flank passes at most arccos(0.5) sin(arccos(0.5)) / (5 x 0.5) = 0.36 of the range that remains.
# One cut off higher up passes less: a larger jump, in a record that is flat for most of its time, is a step.
STEEPEST = 0.36
STEPS = 2.0  # of the converter: the top of a smooth wave is reached by one of them, by two with noise
NEAR_ZERO = 0.02  # of the range: a zero that is off by more is reported for that (quality.OFFSET_LIMIT)
ENOUGH = 3  # flat places elsewhere that show by which steps the channel moves
BELOW = 3  # steps under the top, to which the top is compared
# Near a maximum that is a parabola, the time within h of the top grows as the square root of h; near the
# flattest that waves add up to, of fourth order, as h^(1/4). So of the samples on the top step and the three
# below it, at most this share is on the top one.
NATURAL = (1.0 + BELOW) ** -0.25


def flat_top(values: Array, level: float, ends: tuple[bool, bool] = (True, True)) -> int:
    """Return how many samples in a row are at an extreme at which the channel (n,) was cut off; else 0.

    An extreme of zero is a gate (a hammer's force window). One near zero, or one that is left by the steps of
    the converter, at which the channel stays for most of the record, or only at its start or its end, is a
    channel at rest; an amplifier that is driven to its end stays there far from zero. One that is reached by
    a jump, in a record of flat places, is a step. One that is reached by the steps of the converter, and kept
    no longer than a maximum keeps its top step, is a wave that was sampled coarsely.

    Parameters
    ----------
    level : the least or the greatest of the values.
    ends : whether the first sample is the record's first, and the last its last; else it goes on.
    """
    start, stop = _runs(values)
    here = values[start] == level
    longest = int((stop - start)[here].max(initial=0))
    if level == 0.0 or not longest:
        return 0
    jumps = _jumps(values, start, stop)
    rise, step = float(np.median(jumps[here])), _step(values, start, jumps)
    inner = here & ((start > 0) | (not ends[0])) & ((stop < len(values)) | (not ends[1]))
    near_zero = abs(level) <= NEAR_ZERO * float(np.ptp(values))
    if (near_zero or rise <= STEPS * step) and (not inner.any() or longest > len(values) / 2):
        return 0
    flat_for = int((stop - start).sum())
    if rise > STEEPEST * float(np.ptp(values)) and flat_for > len(values) / 2:
        return 0
    below = np.abs(values - level)
    on_top, near = np.sum(below < 0.5 * step), np.sum(below < (BELOW + 0.5) * step)
    return longest if rise > STEPS * step or on_top > NATURAL * near else 0


def longest_run(true: np.ndarray) -> int:
    """Return the length of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], true.astype(np.int8), [0]))))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def _runs(values: Array) -> tuple[np.ndarray, np.ndarray]:
    """Return start and stop of each run of equal samples that is long enough to be a flat top."""
    edges = np.concatenate(([0], np.flatnonzero(np.diff(values)) + 1, [len(values)]))
    long = np.diff(edges) >= FLAT_TOP_SAMPLES
    return edges[:-1][long], edges[1:][long]


def _jumps(values: Array, start: np.ndarray, stop: np.ndarray) -> Array:
    """Return how far each run is from the nearer in value of its two neighbours; infinite without any."""
    last = len(values) - 1
    before = np.where(start > 0, np.abs(values[np.maximum(start - 1, 0)] - values[start]), np.inf)
    after = np.where(stop <= last, np.abs(values[np.minimum(stop, last)] - values[start]), np.inf)
    return np.minimum(before, after)


def _step(values: Array, start: np.ndarray, jumps: Array) -> float:
    """Return the step by which a channel moves where it is flat between its extremes.

    Without flat places it is the least difference of two values: of a channel that was levelled after it was
    sampled, that is a much smaller one.
    """
    low, high = float(np.min(values)), float(np.max(values))
    between = (values[start] > low) & (values[start] < high) & np.isfinite(jumps)
    resolution = float(np.min(np.diff(np.unique(values)), initial=np.inf))
    return max(resolution, float(np.median(jumps[between]))) if between.sum() >= ENOUGH else resolution
