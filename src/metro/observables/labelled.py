"""What the stages and the loop need of a problem whose measurements are labels: stable or unstable tests."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np
import pandas as pd

from metro.units import Array

if TYPE_CHECKING:
    from metro.observables.task import Handler

Change = Callable[[Any], Any]
Result = TypeVar("Result")


class Labelled(Protocol):
    """A problem of n labelled tests at p points: speeds of cuts at places whose modes are known."""

    @property
    def observable(self) -> str:
        """Name of the observable, one of the contract's."""
        ...

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
    def point_cut(self) -> np.ndarray:
        """(p,) which cut each point is of, by a number: those that differ in what the teeth go through."""
        ...

    @property
    def model_sd(self) -> float:
        """Standard deviation of the log of the depth for what the models leave out."""
        ...

    @property
    def label_error(self) -> float:
        """Probability that a label is wrong whatever the depth."""
        ...

    def boundaries(self, changes: Sequence[Change]) -> tuple[Array, Array]:
        """Log depths and chatter frequencies (t, p) of the boundary after each of t changes of the models."""
        ...

    def estimates(self, changes: Sequence[Change]) -> tuple[Array, Array]:
        """Return the same, roughly and quickly."""
        ...

    def boundaries_at(self, changes: Sequence[Change], rpm: Array) -> Array:
        """Log depths (t, k) of the boundary of the cut of most tests at speeds ``rpm`` after each change."""
        ...

    def deviations(self, draws: int, seed: int) -> Array:
        """(draws, p) deviations of the log depth by what the base model is uncertain of."""
        ...

    def comparison(self) -> pd.DataFrame:
        """Rows of the comparison table: measured 1 is unstable; before and after, the probability of that."""
        ...

    def redrawn(self, observed: Mapping[str, pd.DataFrame], change: Change) -> dict[str, pd.DataFrame]:
        """Return the observed tables that a change of the models changes, drawn anew."""
        ...

    def with_notes(self, notes: Sequence[str]) -> Labelled:
        """Return the problem with further notes."""
        ...

    def handled_by(self, handler: Handler[Result]) -> Result:
        """Let a handler do with the problem what it does with those whose measurements are labels."""
        ...
