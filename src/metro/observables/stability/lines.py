"""Which lines of a group of receptances say something: common to all, clear of drift and of noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from metro.observables.stability.receptance import Receptance
from metro.units import Array, ComplexArray

WIDE_ENOUGH = 0.5  # share of a pair's lines that others must have for it to give up the rest
_LEAST_LINES = 40
_QUIET_LINES = 5  # in a row, from which on a drift has ended or a response exceeds the noise
# The mean power of five lines of noise is hardly ever below a quarter of its long-run value, and five in a
# row exceed nine times that in one of 75,000 cases: exp(-9/4) to the fifth power.
_RISE = 9.0
_CAUSED = 0.5  # share of a response's power that the force causes: a line with less is mostly noise
_SAME_LINE = 0.05  # of the step between lines: rates read from time stamps differ by their rounding


def on_common_lines(group: list[Receptance], notes: list[str]) -> list[Receptance]:
    """Return receptances on the same lines. Files left out are named.

    All are kept on the lines that all have, if these are half of what most pairs have; else most pairs are.
    """
    sets = [np.round(item.frequency / (_SAME_LINE * _step(group))).astype(np.int64) for item in group]
    if all(np.array_equal(lines, sets[0]) for lines in sets):
        return group
    shared = sets[0]
    for lines in sets[1:]:
        shared = np.intersect1d(shared, lines)
    kinds = [next(i for i, other in enumerate(sets) if np.array_equal(other, lines)) for lines in sets]
    most = max(kinds, key=lambda kind: (kinds.count(kind), len(sets[kind])))
    place = f"position {group[0].position}, direction {group[0].response[-1]}"
    if len(shared) >= max(_LEAST_LINES, WIDE_ENOUGH * len(sets[most])):
        longest = max(len(lines) for lines in sets)
        notes.append(
            f"{place}: the FRFs have {min(map(len, sets))} to {longest} lines; the {len(shared)} that all "
            "have are fitted"
        )
        return [_on(item, np.isin(lines, shared)) for item, lines in zip(group, sets, strict=True)]
    left = [item.pair for item, kind in zip(group, kinds, strict=True) if kind != most]
    notes.append(
        f"{place}: {', '.join(left)}: not used, on other lines than the {kinds.count(most)} others; export "
        "all FRFs with the same lines"
    )
    return [item for item, kind in zip(group, kinds, strict=True) if kind == most]


def excited_to(record: Receptance) -> float:
    """Frequency, Hz, up to which the hammer of a record excites the structure."""
    return float(record.frequency[record.usable].max(initial=0.0))


def _step(group: list[Receptance]) -> float:
    steps = [float(np.median(np.diff(item.frequency))) for item in group if len(item.frequency) > 1]
    return min(steps, default=1.0)


def _on(item: Receptance, lines: np.ndarray) -> Receptance:
    return replace(
        item,
        frequency=item.frequency[lines],
        frf=item.frf[lines],
        variance=None if item.variance is None else item.variance[lines],
        deviation=item.deviation[:, lines],
        usable=item.usable[lines],
        coherence=None if item.coherence is None else item.coherence[lines],
    )


def clear_lines(
    frequency: Array, frf: ComplexArray, variance: Array | None, coherence: Sequence[Array | None]
) -> np.ndarray:
    """Lines (n,) of FRFs (n, c) that hold more than drift and noise.

    By the scatter of repeats where all have some; else by the coherence where all files have it; else
    by the course of the FRFs alone.
    """
    if variance is not None:
        return clear_of_noise(frf, variance)
    known = [each for each in coherence if each is not None]
    if len(known) == frf.shape[1]:
        return clear_of_incoherence(np.mean(known, axis=0))
    return clear_of_drift(frequency, frf)


def clear_of_drift(frequency: Array, frf: ComplexArray) -> np.ndarray:
    """Lines above an integrated acceleration's drift, which falls from the first line on.

    It has ended where |H| stays below 30 times its median, and in any case where |H| rises again: before a
    resonance, however high that is and however low in the band. Where |H| rises from the first line on, there
    is none: lines may be too wide apart for a resonance low in the band to show more than its peak.
    """
    power = np.mean(np.abs(frf) ** 2, axis=1)
    low = (power < 900.0 * np.median(power)) | (frequency > 0.25 * frequency[-1])
    quiet = _in_a_row(low)
    start = min(int(quiet[0]) if len(quiet) else 0, _fallen(power))
    if start and _RISE * power[0] < np.max(power[:start]):
        start = 0
    return np.arange(len(frequency)) >= start


def _fallen(power: Array) -> int:
    """Line at which the power (n,) ends to fall; n where it never rises again.

    It rises where each of a few lines in a row is well above the least mean of as many before them: a line
    that stands out alone is no resonance, and narrow ones have flanks.
    """
    if len(power) < 2 * _QUIET_LINES:
        return len(power)
    windows = np.lib.stride_tricks.sliding_window_view(power, _QUIET_LINES)
    mean, least = windows.mean(axis=1), windows.min(axis=1)
    risen = np.flatnonzero(least > _RISE * np.minimum.accumulate(mean))
    if not len(risen):
        return len(power)
    lowest = int(np.argmin(mean[: risen[0]]))
    return lowest + _QUIET_LINES // 2 if lowest else 0


def clear_of_incoherence(coherence: Array) -> np.ndarray:
    """Lines from the first to the last few at which the force causes most of the response."""
    return _inside(_in_a_row(coherence > _CAUSED), len(coherence))


def _in_a_row(lines: np.ndarray) -> np.ndarray:
    """Return indices from which on a few lines in a row are true: a single line may be true by chance."""
    return np.flatnonzero(np.convolve(lines, np.ones(_QUIET_LINES), mode="valid") == _QUIET_LINES)


def clear_of_noise(frf: ComplexArray, variance: Array) -> np.ndarray:
    """Lines from the first to the last few that exceed the scatter of the hits."""
    level, noise = np.mean(np.abs(frf) ** 2, axis=1), np.mean(variance, axis=1)
    return _inside(_in_a_row(level > 9.0 * noise), len(frf))


def _inside(clear: np.ndarray, count: int) -> np.ndarray:
    """Lines (count,) from the first of runs that begin at ``clear`` to the end of the last; all if few."""
    lines = np.arange(count)
    if len(clear) < _LEAST_LINES:
        return lines >= 0
    inside: np.ndarray = (lines >= clear[0]) & (lines < clear[-1] + _QUIET_LINES)
    return inside
