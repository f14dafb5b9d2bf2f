"""What the loop needs of a problem whose measurements are labels: tests that were stable or not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from metro.loop.label_evidence import Labels
from metro.units import Array

Change = Callable[[Any], Any]


class Labelled(Protocol):
    """A problem of n labelled tests at p points: speeds of cuts at places whose modes are known."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What the problem left out or assumed."""
        ...

    @property
    def runs(self) -> tuple[str, ...]:
        """Names of the tests."""
        ...

    @property
    def roles(self) -> tuple[str, ...]:
        """Which tests identify and which validate."""
        ...

    @property
    def unstable(self) -> np.ndarray:
        """(n,) whether each test chattered."""
        ...

    @property
    def depth(self) -> Array:
        """(n,) axial depth, m."""
        ...

    @property
    def point(self) -> np.ndarray:
        """(n,) of each test among the p points; −1 where no modes are known."""
        ...

    @property
    def chatter_hz(self) -> Array:
        """(n,) measured, Hz; NaN where not known."""
        ...

    @property
    def point_rpm(self) -> Array:
        """(p,) speed of each point, rev/min."""
        ...

    @property
    def point_tooth_hz(self) -> Array:
        """(p,) frequency at which the teeth come at each point, Hz."""
        ...

    @property
    def model_sd(self) -> float:
        """Standard deviation of the log of the depth for what the models leave out."""
        ...

    @property
    def label_error(self) -> float:
        """Probability that a label is wrong whatever the depth."""
        ...

    def boundaries(self, change: Change) -> tuple[Array, Array]:
        """Log depth and chatter frequency of the boundary at all points after a change of the models."""
        ...

    def estimates(self, changes: Sequence[Change]) -> tuple[Array, Array]:
        """Return the same (t, p), roughly and quickly, after each of t changes."""
        ...

    def boundary_at(self, change: Change, rpm: Array) -> Array:
        """Log depth of the boundary of the cut of most tests at speeds ``rpm`` after a change."""
        ...

    def deviations(self, draws: int, seed: int) -> Array:
        """(draws, p) deviations of the log depth by what the base model is uncertain of."""
        ...


def tests_of(problem: Labelled, role: str) -> tuple[Labels, tuple[str, ...]]:
    """Return the tests of a role at places whose modes are known, and their runs."""
    which = (np.array(problem.roles) == role) & (problem.point >= 0)
    return _labels(problem).take(which), tuple(np.array(problem.runs, dtype=object)[which])


def every_test(problem: Labelled) -> Labels:
    """Return all tests at places whose modes are known, of any role."""
    return _labels(problem).take(problem.point >= 0)


def _labels(problem: Labelled) -> Labels:
    return Labels(
        problem.point,
        np.log(problem.depth),
        problem.unstable.astype(float),
        problem.chatter_hz,
        problem.point_rpm,
        problem.point_tooth_hz,
        problem.model_sd,
        problem.label_error,
    )
