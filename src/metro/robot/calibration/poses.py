"""Poses that were measured: where an arm's joints stood, and where a point on its flange was seen."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
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
    pose : (m,) which rows are of one pose, that of several points on the flange; each its own where left out.
    point : (m,) which point on the flange it is, from 0; all the first where left out.
    distance : (m,) m, from a station to the point, where that alone was measured; NaN where left out.
        ``at`` is then where the declared arm has the point, and serves to part the workspace only.
    station : (m,) from which the distance was measured, from 0; all from the first where left out.
    payload : (m,) kg on the flange beyond what it always carries; 0 where left out.
    """

    q: Array
    at: Array
    sigma: Array
    time: Array
    temperature: Array
    came: Array
    pose: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))
    point: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))
    distance: Array = field(default_factory=lambda: np.zeros(0))
    station: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))
    payload: Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        count = len(self.q)
        usual = {
            "pose": np.arange(count),
            "point": np.zeros(count, dtype=int),
            "distance": np.full(count, np.nan),
            "station": np.zeros(count, dtype=int),
            "payload": np.zeros(count),
        }
        for name, values in usual.items():
            if len(getattr(self, name)) != count:
                object.__setattr__(self, name, values)

    def __len__(self) -> int:
        return len(self.q)

    def of(self, chosen: np.ndarray) -> Poses:
        """Return some of the poses; from where each was approached stays known."""
        return replace(self, **{each.name: getattr(self, each.name)[chosen] for each in fields(self)})

    @property
    def by_distance(self) -> bool:
        """Whether distances from stations were measured, and no positions."""
        return bool(np.isfinite(self.distance).all())

    def thinned(self, count: int) -> Poses:
        """Return poses with at most so many rows, every so many where there are more."""
        return self.of(self.evenly(count))

    def evenly(self, count: int) -> np.ndarray:
        """Return the numbers of at most ``count`` rows, those of poses at equal distances; none is parted."""
        _, pose = np.unique(self.pose, return_inverse=True)
        total = int(pose.max()) + 1
        return np.flatnonzero(np.isin(pose, evenly(total, count * total // len(self))))

    def parted(self, halvings: int) -> np.ndarray:
        """Return of each row in which of 2^halvings regions of the workspace its pose is, (m,) int."""
        _, first, pose = np.unique(self.pose, return_index=True, return_inverse=True)
        return np.asarray(regions(self.at[first], halvings)[pose])

    @cached_property
    def regions(self) -> np.ndarray:
        """Return of each row which of sixteen regions of the workspace it is in, (m,) int."""
        return self.parted(4)

    @property
    def first(self) -> Poses:
        """The rows of the first point."""
        return self.of(self.point == 0)


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
