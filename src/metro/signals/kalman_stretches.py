"""The random walk of :mod:`metro.signals.kalman` over stretches, between which the level may jump.

A random walk of one drift cannot follow a level that is at rest, then ramps, then is at rest again: a drift
that follows the ramp leaves the rest unsmoothed, and the innovations have a sign on the ramp and alternate on
the rest. Where such ramps lie is known beforehand (the tool enters and leaves the work), so nothing is
assumed there: every sample is a stretch of its own, and the walk starts anew behind it. Noise and drift are
common to all stretches.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from metro.signals import kalman, kalman_uneven
from metro.units import Array


def stretches(phase: np.ndarray) -> tuple[slice, ...]:
    """Part samples by their ``phase`` (n,) int: one stretch each, where it is odd every sample by itself.

    In an odd phase the level may do anything. It may have done so, too, where a phase is skipped because the
    samples of it were lost.
    """
    phase = phase.astype(int)
    starts = np.flatnonzero(np.concatenate([[True], (phase[1:] != phase[:-1]) | (phase[1:] % 2 == 1)]))
    return tuple(slice(int(a), int(b)) for a, b in zip(starts, [*starts[1:], len(phase)], strict=True))


def _within(part: slice, interval: Array | None) -> Array | None:
    """Intervals inside a stretch; None where they are even, or where there are none."""
    return None if interval is None or part.stop - part.start < 2 else interval[part.start : part.stop - 1]


def log_likelihood(
    signal: Array, measurement: Array, drift: Array, parts: Sequence[slice], interval: Array | None
) -> Array:
    """Log-likelihood (g, k) of channels (n, k), each stretch given its first sample, for Q (g, k)."""
    total = np.zeros(drift.shape)
    for part in parts:
        if part.stop - part.start > 1:
            here = _within(part, interval)
            total += (
                kalman.log_likelihood(signal[part], measurement, drift)
                if here is None
                else kalman_uneven.log_likelihood(signal[part], measurement, drift, here)
            )
    return total


def likeliest_drift(
    signal: Array, measurement: Array, parts: Sequence[slice], interval: Array | None = None
) -> Array:
    """Q (k,) that makes the channels (n, k) likeliest, given R (k,); per median ``interval`` if uneven."""
    likelihood = partial(log_likelihood, parts=parts, interval=interval)
    return kalman.likeliest_drift(signal, measurement, likelihood)


def smooth(
    signal: Array, measurement: Array, drift: Array, parts: Sequence[slice], interval: Array | None = None
) -> tuple[Array, Array]:
    """Level (n, k) of each channel and its variance (n, k), from all samples of the stretch it is in."""
    smoothed = [
        kalman.smooth(signal[part], measurement, drift)
        if (here := _within(part, interval)) is None
        else kalman_uneven.smooth(signal[part], measurement, drift, here)
        for part in parts
    ]
    level, variance = (np.concatenate(of_parts) for of_parts in zip(*smoothed, strict=True))
    return level, variance


def innovations(
    signal: Array, measurement: Array, drift: Array, parts: Sequence[slice], interval: Array | None = None
) -> Array:
    """Innovations (n', k), in standard deviations, of all stretches one after another."""
    return np.concatenate(
        [
            kalman.innovations(signal[part], measurement, drift)
            if (here := _within(part, interval)) is None
            else kalman_uneven.innovations(signal[part], measurement, drift, here)
            for part in parts
        ]
    )


def combined_covariance(
    weights: Array,
    measurement: Array,
    drift: Array,
    parts: Sequence[slice],
    interval: Array | None = None,
) -> Array:
    """Covariance (c, c) of sums Σ w x of smoothed levels, for weights (c, n, k): a sum over the stretches."""
    total = np.zeros((len(weights), len(weights)))
    for part in parts:
        here, weight = _within(part, interval), weights[:, part]
        total += (
            kalman.combined_covariance(weight, measurement, drift)
            if here is None
            else kalman_uneven.combined_covariance(weight, measurement, drift, here)
        )
    return total
