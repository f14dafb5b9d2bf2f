"""Errors on poses that no fit saw: left out at random, by regions of the workspace, and by time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from metro.robot.calibration.fit import Fit
from metro.robot.calibration.measured import residuals
from metro.robot.calibration.poses import Poses
from metro.units import Array

MOST = 5000  # poses of which some are left out; of more, every so many
FIFTH = 5
QUARTERS = 4
HALF_WIDTH = 0.98  # ranks about the median per root of the count: 95 % of a binomial of one half

Fitting = Callable[[Poses], tuple[Fit, ...]]


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Distances of held-out poses from where they were predicted.

    Attributes
    ----------
    kind : random, region or time. which : (m,) numbers of the rows, of the first point alone.
    errors : (fits, m, d) m, measured less predicted, by one fit after the other: of d = 3 coordinates, or
        of the distance.
    """

    kind: str
    which: np.ndarray
    errors: Array

    @property
    def distances(self) -> Array:
        """Lengths (fits, m) of the errors, m."""
        return np.asarray(np.linalg.norm(self.errors, axis=2))


def held_out(poses: Poses, fits: Fitting) -> tuple[HeldOut, ...]:
    """Fit to the poses that are kept and predict those left out, for each way of leaving out.

    ``fits``: all that is fitted, the choice of effects included, from the poses that it is given.
    """
    chosen = poses.evenly(MOST)
    some = poses.of(chosen)
    found = []
    for kind, folds in _folds(some):
        parts = []
        for out in folds:
            left = fits(some.of(~out))
            unseen = some.of(out)
            parts.append(np.stack([residuals(fit.state, fit.predicted(unseen), unseen) for fit in left]))
        which = np.concatenate([chosen[out] for out in folds])
        first = poses.point[which] == 0
        found.append(HeldOut(kind, which[first], np.concatenate(parts, axis=1)[:, first]))
    return tuple(found)


def _folds(poses: Poses) -> Iterator[tuple[str, list[np.ndarray]]]:
    """Yield the kinds of leaving out, each with masks (m,) of what is left out at once.

    A random fifth; each quarter of the workspace; each quarter of the time.
    """
    _, pose = np.unique(poses.pose, return_inverse=True)
    shuffled = np.random.default_rng(0).permutation(int(pose.max()) + 1)
    yield "random", [shuffled[pose] % FIFTH == 0]
    quarter = poses.parted(2)
    yield "region", [quarter == one for one in np.unique(quarter)]
    order = np.empty(len(poses), dtype=int)
    order[np.argsort(poses.time, kind="stable")] = np.arange(len(poses))
    late = order * QUARTERS // len(poses)
    yield "time", [late == one for one in range(QUARTERS)]


def median(distances: Array) -> tuple[float, float, float]:
    """Return the median of distances with its 95 % interval by order statistics."""
    ordered = np.sort(distances)
    half = HALF_WIDTH * np.sqrt(len(ordered))
    low, high = (int(np.clip(len(ordered) / 2 + side * half, 0, len(ordered) - 1)) for side in (-1, 1))
    return float(np.median(ordered)), float(ordered[low]), float(ordered[high])
