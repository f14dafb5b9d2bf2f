"""Where in a force record the tool is in the air, entering, cutting steadily, leaving."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array

IN_AIR, CUTTING = 0.12, 0.5


@dataclass(frozen=True)
class Segments:
    """The steady cut of a record, and where it is in the air: (n,) bool."""

    steady: slice
    air: np.ndarray


def segments(signal: Array, samples_per_revolution: float, settling: int) -> Segments:
    """Find the steady cut and the air in a record by the level of the force in each revolution.

    The level is the rms of all channels about the air's zero. Revolutions below 12 % of the typical level are
    air; the cut is the longest run above half of it. Where the record shows an end of the cut, what the tool
    needs to get wholly in or out is left off there: the force looks steady well before the engagement is.

    Parameters
    ----------
    signal : (n, channels). samples_per_revolution : of the spindle.
    settling : samples from the first contact to the full engagement.

    Raises
    ------
    ValueError
        If less than six revolutions are left.
    """
    length = max(2, round(samples_per_revolution))
    count = len(signal) // length
    if count < 6:
        return Segments(slice(0, len(signal)), np.zeros(len(signal), dtype=bool))
    turns = signal[: count * length].reshape(count, length, -1)
    level = _level(turns, np.zeros(signal.shape[1]))
    quiet = level < IN_AIR * np.quantile(level, 0.9)
    if quiet.any():
        level = _level(turns, turns[quiet].mean(axis=(0, 1)))
    typical = np.median(level[level > 0.5 * np.quantile(level, 0.9)])
    first, last = _longest(level > CUTTING * typical)
    air = np.repeat(_clear(level < IN_AIR * typical), length)
    start = first * length + (settling if first > 0 else 0)
    stop = last * length - settling if last < count else len(signal)
    if stop - start < 6 * length:
        raise ValueError(
            "the cut is over before the tool is fully engaged: fewer than six steady revolutions"
        )
    return Segments(slice(start, stop), np.pad(air, (0, len(signal) - len(air))))


def _clear(quiet: np.ndarray) -> np.ndarray:
    """Quiet revolutions beside quiet ones: where the tool first touches, it cuts a little already."""
    padded = np.pad(quiet, 1, constant_values=True)
    clear = quiet & padded[:-2] & padded[2:]
    return clear if clear.any() else quiet


def _level(turns: Array, zero: Array) -> Array:
    return np.asarray(np.sqrt(((turns - zero) ** 2).sum(axis=2).mean(axis=1)))


def _longest(mask: np.ndarray) -> tuple[int, int]:
    """Start and end of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    starts, ends = edges[::2], edges[1::2]
    best = int(np.argmax(ends - starts))
    return int(starts[best]), int(ends[best])
