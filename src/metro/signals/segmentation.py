"""Air, cut-in, steady, cut-out: change points of an estimated force or torque along its path or time.

The cut is a trapezoid common to all channels: zero, a rise, a level, a fall. :mod:`metro.signals.steady`
does this for records whose revolutions can be counted; here is only a slow course, and its knees are fitted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array

AIR, CUT_IN, STEADY, CUT_OUT = "air", "cut-in", "steady", "cut-out"
PLACES = 36  # of a knee that are tried at once
ROUNDS = 4
MOST = 400  # places of a course that matter: more are averaged


@dataclass(frozen=True)
class Knees:
    """Where the cut begins, is whole, begins to leave, and has left; a pair that is not seen is None."""

    begins: float | None
    whole: float | None
    leaves: float | None
    left: float | None

    def names(self, place: Array) -> np.ndarray:
        """Name of the part (m,) that each place belongs to."""
        named = np.full(len(place), STEADY, dtype=object)
        if self.begins is not None and self.whole is not None:
            named[place < self.whole] = CUT_IN
            named[place < self.begins] = AIR
        if self.leaves is not None and self.left is not None:
            named[place > self.leaves] = CUT_OUT
            named[place > self.left] = AIR
        return named


def knees(place: Array, course: Array) -> Knees:
    """Fit the knees by least squares; an entry or an exit counts where Schwarz's criterion asks for it.

    Parameters
    ----------
    place : (m,) rising. course : (m, k) channels, each about its zero in the air.
    """
    group = -(-len(place) // MOST)
    whole = len(place) // group * group
    place = place[:whole].reshape(-1, group).mean(axis=1)
    course = course[:whole].reshape(len(place), group, -1).mean(axis=1)
    course = course / max(float(np.sqrt((course**2).mean())), 1e-300)
    best: tuple[float, Knees] | None = None
    for entry in (False, True):
        for leaving in (False, True):
            fit, residual = _fitted(place, course, entry, leaving)
            criterion = _criterion(course, residual, 2 * (entry + leaving))
            if best is None or criterion < best[0]:
                best = criterion, fit
    assert best is not None
    return best[1]


def _criterion(course: Array, residual: Array, parameters: int) -> float:
    """Schwarz's criterion, with the number of independent samples by the residual's autocorrelation."""
    count = residual.size
    power = float((residual**2).mean()) + 1e-12
    alike = float((residual[1:] * residual[:-1]).mean()) / power
    alike = min(max(alike, 0.0), 0.95)
    independent = max(count * (1 - alike) / (1 + alike), 4.0)
    return float(independent * np.log(power) + (parameters + course.shape[1]) * np.log(independent))


def _fitted(place: Array, course: Array, entry: bool, leaving: bool) -> tuple[Knees, Array]:
    """Knees of least squares, entry and exit in turn, on ever finer places."""
    ends = np.array([place[0], place[0], place[-1], place[-1]])
    spans = dict.fromkeys((0, 2), (place[0], place[-1]))
    for _ in range(ROUNDS):
        for side in (side for side, there in ((0, entry), (2, leaving)) if there):
            low, high = spans[side]
            first, second = np.triu_indices(PLACES, 1)
            tried = np.linspace(low, high, PLACES)
            candidates = np.tile(ends, (len(first), 1))
            candidates[:, side], candidates[:, side + 1] = tried[first], tried[second]
            inside = candidates[:, 1] < candidates[:, 2] if entry and leaving else np.full(len(first), True)
            candidates = candidates[inside]
            if len(candidates):
                ends = candidates[np.argmin(_left(place, course, candidates, entry, leaving))]
            step = (high - low) / (PLACES - 1)
            spans[side] = (
                max(place[0], ends[side] - 3 * step),
                min(place[-1], ends[side + 1] + 3 * step),
            )
    shape = _shape(place, ends[None], entry, leaving)[0]
    level = shape @ course / max(float(shape @ shape), 1e-12)
    knee = [float(end) for end in ends]
    fit = Knees(*(knee[:2] if entry else (None, None)), *(knee[2:] if leaving else (None, None)))
    return fit, course - np.outer(shape, level)


def _shape(place: Array, ends: Array, entry: bool, leaving: bool) -> Array:
    """Trapezoids (c, m) of candidates (c, 4)."""
    shape = np.ones((len(ends), len(place)))
    if entry:
        width = np.maximum(ends[:, 1] - ends[:, 0], 1e-12)[:, None]
        shape *= np.clip((place - ends[:, :1]) / width, 0.0, 1.0)
    if leaving:
        width = np.maximum(ends[:, 3] - ends[:, 2], 1e-12)[:, None]
        shape *= np.clip((ends[:, 3:] - place) / width, 0.0, 1.0)
    return shape


def _left(place: Array, course: Array, ends: Array, entry: bool, leaving: bool) -> Array:
    """Sum of squares (c,) that the best level of each channel leaves."""
    shape = _shape(place, ends, entry, leaving)
    power = np.maximum((shape**2).sum(axis=1), 1e-12)
    return np.asarray((course**2).sum() - ((shape @ course) ** 2).sum(axis=1) / power)
