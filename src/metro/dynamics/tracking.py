"""Which mode of one place is which of another: modes followed over places by frequency and shape.

Every two modes of neighbouring places are alike by the distance of their frequencies and by the modal
assurance criterion of their shapes; the pairs with the least sum are the same mode.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np

from metro.dynamics.shapes import mac
from metro.units import Array, ComplexArray

# A mode may change by a quarter of an octave from one place to the next, and keeps half of its shape: beyond
# either, more distant than most two modes of one place are, a pair is none.
REACH = 0.25 * np.log(2.0)
LEAST_MAC = 0.5
FEWEST_POINTS = 3  # that make a shape


@dataclass(frozen=True, eq=False)
class Seen:
    """Modes of one place and direction.

    Attributes
    ----------
    frequency : (m,) Hz, rising. shape : (m, c). points : (c,) names of what the shape is measured at.
    """

    frequency: Array
    shape: ComplexArray
    points: tuple[Hashable, ...]


@dataclass(frozen=True, eq=False)
class Tracks:
    """How the modes of one test go on from those of another.

    Attributes
    ----------
    number : (m,) of each mode among all that were followed, from 1 by rising mean frequency.
    before : index of the test that it was compared with; −1 for the first.
    alike : (m,) modal assurance criterion with the mode there; NaN where there is none, or too few points.
    """

    number: np.ndarray
    before: int
    alike: Array


def follow(tests: Sequence[Seen], distance: Array | None = None) -> list[Tracks]:
    """Follow modes from the test with most of them to its nearest neighbour, and on to theirs.

    Parameters
    ----------
    distance : (n, n) of the places; None: each test follows the one before it.
    """
    if not tests:
        return []
    first = 0 if distance is None else int(np.argmax([len(test.frequency) for test in tests]))
    families: list[list[float]] = [[float(f)] for f in tests[first].frequency]
    member = {first: np.arange(len(families))}
    before, alike = {first: -1}, {first: np.full(len(families), np.nan)}
    while len(member) < len(tests):
        known, new = _nearest(list(member), len(tests), distance)
        other, criterion = _paired(tests[known], tests[new])
        own = np.empty(len(other), dtype=int)
        for i, j in enumerate(other):
            if j < 0:
                families.append([])
            own[i] = member[known][j] if j >= 0 else len(families) - 1
            families[own[i]].append(float(tests[new].frequency[i]))
        member[new], before[new], alike[new] = own, known, criterion
    rank = np.argsort(np.argsort([np.mean(family) for family in families], kind="stable"), kind="stable")
    return [Tracks(1 + rank[member[i]], before[i], alike[i]) for i in range(len(tests))]


def _nearest(known: list[int], count: int, distance: Array | None) -> tuple[int, int]:
    """Return the known and the new test that are nearest to each other."""
    others = [i for i in range(count) if i not in known]
    if distance is None:
        return known[-1], others[0]
    return min(((k, n) for n in others for k in known), key=lambda pair: (distance[pair], pair))


def _paired(known: Seen, new: Seen) -> tuple[np.ndarray, Array]:
    """Partner (m,) of each new mode among the known ones, −1 without one, and how similar they are (m,)."""
    from scipy.optimize import linear_sum_assignment

    way = np.abs(np.log(new.frequency[:, None] / known.frequency[None, :]))
    criterion = _likeness(known, new)
    cost = way / REACH + np.where(np.isnan(criterion), 0.0, 1.0 - criterion)
    allowed = (way <= REACH) & ~(criterion < LEAST_MAC)
    rows, columns = linear_sum_assignment(np.where(allowed, cost, 1e3))
    partner, alike = np.full(len(new.frequency), -1), np.full(len(new.frequency), np.nan)
    for i, j in zip(rows, columns, strict=True):
        if allowed[i, j]:
            partner[i], alike[i] = j, criterion[i, j]
    return partner, alike


def _likeness(known: Seen, new: Seen) -> Array:
    """Modal assurance criterion (m, k) at the points of both; NaN where they are too few to make a shape."""
    shared = [point for point in new.points if point in known.points]
    if len(shared) < FEWEST_POINTS:
        return np.full((len(new.frequency), len(known.frequency)), np.nan)
    there = [known.points.index(point) for point in shared]
    here = [new.points.index(point) for point in shared]
    return mac(new.shape[:, here], known.shape[:, there])
