"""Poses that were measured: where an arm's joints stood, and where a point on its flange was seen."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from metro.units import Array

STILL = 1e-4  # rad or m: a joint that moved less since the pose before did not move


@dataclass(frozen=True, eq=False)
class Poses:
    """Measured poses, in the order in which they were taken.

    Attributes
    ----------
    q : (m, n) readings of the joints, rad (m of one that shifts).
    at : (m, 3) measured positions, m, in the frame of the instrument.
    sigma : (m,) standard deviation of a coordinate by the instrument, m; 0 where it is not stated.
    time : (m,) s, or the number of the pose where no time is known.
    temperature : (m,) °C; NaN where it is not known.
    came : (m, n) direction in which each joint moved last, −1, 1, or 0 where it is not known.
    """

    q: Array
    at: Array
    sigma: Array
    time: Array
    temperature: Array
    came: Array

    def __len__(self) -> int:
        return len(self.q)

    def of(self, chosen: np.ndarray) -> Poses:
        """Return some of the poses; from where each was approached stays known."""
        fields = ("q", "at", "sigma", "time", "temperature", "came")
        return replace(self, **{name: getattr(self, name)[chosen] for name in fields})

    def thinned(self, count: int) -> Poses:
        """Return at most so many of the poses, every so many where there are more."""
        return self.of(evenly(len(self), count))

    @cached_property
    def regions(self) -> np.ndarray:
        """Return of each pose which of sixteen regions of the workspace it is in, (m,) int."""
        return regions(self.at, 4)


def evenly(total: int, count: int) -> np.ndarray:
    """Return at most ``count`` of the numbers below ``total``, at equal distances."""
    return np.linspace(0, total - 1, min(total, count)).astype(int)


def regions(points: Array, halvings: int) -> np.ndarray:
    """Part points (m, 3) into 2^halvings regions of as many points, each by halving one across its length."""
    region = np.zeros(len(points), dtype=int)
    for _ in range(halvings):
        for one in range(int(region.max()) + 1):
            mine = np.flatnonzero(region == one)
            if len(mine) > 1:
                along = points[mine][:, int(np.argmax(np.ptp(points[mine], axis=0)))]
                region[mine[np.argsort(along, kind="stable")[len(mine) // 2 :]]] += int(1e6)
        region = np.unique(region, return_inverse=True)[1]
    return region


def approached(q: Array) -> Array:
    """Return in which direction each joint moved last, (m, n), from readings in the order of the poses."""
    steps = np.diff(q, axis=0, prepend=q[:1])
    signs = np.where(np.abs(steps) > STILL, np.sign(steps), 0.0)
    last = np.where(signs != 0.0, np.arange(len(q))[:, None], 0)
    return np.asarray(np.take_along_axis(signs, np.maximum.accumulate(last, axis=0), axis=0))
