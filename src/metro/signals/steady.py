"""Where in a force record the tool is in the air, entering, cutting steadily, leaving."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from metro.units import Array

IN_AIR, CUTTING = 0.12, 0.5  # shares of the typical force: below is the air, above is the cut
# Within a revolution the force of a cut swings at least this many times as much as in the air, and its mean
# moves by at least this share of that swing. Chatter swings more as well, but about the same mean.
LIVELIER, MOVED = 3.0, 0.3


@dataclass(frozen=True, eq=False)
class Turns:
    """A record by its revolutions: all that is kept of it once it has been read.

    Attributes
    ----------
    length : samples of a revolution. samples : of the record; a last revolution that is not whole is none.
    mean, square : (turns, channels) mean of each revolution, and of its squares.
    """

    length: int
    samples: int
    mean: Array
    square: Array


@dataclass(frozen=True, eq=False)
class Segments:
    """The steady cut of a record, and which of its revolutions (turns,) are in the air."""

    turns: Turns
    steady: slice
    quiet: np.ndarray


def turns(pieces: Iterable[Array], samples_per_revolution: float) -> Turns:
    """Read a record (n, channels), piece by piece, revolution by revolution of the spindle."""
    length, samples = max(2, round(samples_per_revolution)), 0
    left: Array | None = None
    moments: list[tuple[Array, Array]] = []
    for piece in pieces:
        samples += len(piece)
        joined = piece if left is None else np.concatenate([left, piece])
        whole = len(joined) // length
        each, left = (
            joined[: whole * length].reshape(whole, length, joined.shape[1]),
            joined[whole * length :],
        )
        moments.append((each.mean(axis=1), (each**2).mean(axis=1)))
    mean, square = (np.concatenate(parts) for parts in zip(*moments, strict=True))
    return Turns(length, samples, mean, square)


def segments(record: Turns, settling: int) -> Segments:
    """Find the steady cut and the air in a record by the level of the force in each revolution.

    The level is the rms of all channels about the air's zero, which may drift, less the noise there.
    Revolutions below 12 % of the typical level are air; the cut is the longest run above half of it. Where
    the record shows an end of the cut, what the tool needs to get wholly in or out is cut away there: the
    force looks steady well before the engagement is.

    Parameters
    ----------
    settling : samples from the first contact to the full engagement.

    Raises
    ------
    ValueError
        If less than six revolutions are left, the record is shorter than one, or it shows no force.
    """
    length, samples, count = record.length, record.samples, len(record.mean)
    if count == 0:
        fault = f"the record has {samples} samples, fewer than the {length} of one revolution"
        raise ValueError(f"{fault} at the speed of runs.csv")
    if count < 6:
        return Segments(record, slice(0, samples), np.zeros(count, dtype=bool))
    quiet = _in_air(record)
    zero, noise = np.zeros(record.mean.shape[1]), 0.0
    if quiet.any():
        zero = _zero(record, quiet, float(np.flatnonzero(~quiet).mean()))
        noise = float(np.median(_swing(record)[quiet]))
    level = _level(record, zero, noise)
    if not level.any():
        raise ValueError("the force is nought in the whole record")
    typical = np.median(level[level > 0.5 * np.quantile(level, 0.9)])
    first, last = _longest(level > CUTTING * typical)
    start = first * length + (settling if first > 0 else 0)
    stop = last * length - settling if last < count else samples
    if stop - start < 6 * length:
        raise ValueError(
            "the cut is over before the tool is fully engaged: fewer than six steady revolutions"
        )
    return Segments(record, slice(start, stop), _clear(level < IN_AIR * typical))


def zero_line(mean: Array, quiet: np.ndarray, cut: float) -> tuple[Array, Array]:
    """Zero at the start of a record and its drift per revolution, (channels,) each, by readings in the air.

    Parameters
    ----------
    mean : (turns, channels) of each revolution. quiet : (turns,) which are in the air; some are.
    cut : revolution in the middle of the cut. There is no drift where the air is on one side of it alone.
    """
    middle = np.arange(len(mean)) + 0.5
    sides = [quiet & (middle < cut), quiet & (middle > cut)]
    if not all(side.any() for side in sides):
        return mean[quiet].mean(axis=0), np.zeros(mean.shape[1])
    (before, after), (first, last) = ([of[side].mean(axis=0) for side in sides] for of in (mean, middle))
    drift = (after - before) / (last - first)
    return before - first * drift, drift


def _zero(record: Turns, quiet: np.ndarray, cut: float) -> Array:
    """Return the zero in each revolution, (turns, channels)."""
    start, drift = zero_line(record.mean, quiet, cut)
    return np.asarray(start + (np.arange(len(record.mean))[:, None] + 0.5) * drift)


def _in_air(record: Turns) -> np.ndarray:
    """Revolutions that may be in the air (turns,), before their zero is known.

    They have a constant force, about another mean than where it swings: an amplifier whose charge has drifted
    since it was reset shows a zero far from nought, and it drifts on while the tool cuts. Where that does not
    decide (on a helix the mean of a cut turns with the orbit), they have little force.
    """
    level = _level(record, np.zeros(record.mean.shape[1]))
    quiet: np.ndarray = level < IN_AIR * np.quantile(level, 0.9)
    swing = _swing(record)
    least, most = float(np.sort(swing)[:3].mean()), float(np.quantile(swing, 0.9))
    if most <= LIVELIER * least:
        return quiet
    still, lively = swing < least + IN_AIR * (most - least), swing > CUTTING * most
    about = record.mean - _zero(record, still, float(np.flatnonzero(lively).mean()))
    moved = float(np.linalg.norm(np.median(about[lively], axis=0)))
    wanders = float(np.sqrt((about[still] ** 2).sum(axis=1).mean()))
    return still if moved > MOVED * most and wanders < IN_AIR * moved else quiet


def _clear(quiet: np.ndarray) -> np.ndarray:
    """Quiet revolutions beside quiet ones: where the tool first touches, it cuts a little already."""
    padded = np.pad(quiet, 1, constant_values=True)
    clear = quiet & padded[:-2] & padded[2:]
    return clear if clear.any() else quiet


def _level(record: Turns, zero: Array, noise: float = 0.0) -> Array:
    """Rms of all channels about a zero, (channels,) or (turns, channels), less the noise: (turns,)."""
    about = (record.square - 2.0 * zero * record.mean + zero**2).sum(axis=1)
    return np.asarray(np.sqrt(np.maximum(about - noise**2, 0.0)))


def _swing(record: Turns) -> Array:
    """Rms of all channels about their mean in each revolution."""
    return np.asarray(np.sqrt(np.maximum((record.square - record.mean**2).sum(axis=1), 0.0)))


def _longest(mask: np.ndarray) -> tuple[int, int]:
    """Start and end of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    starts, ends = edges[::2], edges[1::2]
    best = int(np.argmax(ends - starts))
    return int(starts[best]), int(ends[best])
