"""What a strategy of the search is given, and what it returns.

A strategy goes from a base fit, and the effects that these runs can show, to a fit with those that it adds.
How the outcome is then described is the same for all strategies (:mod:`metro.loop.search.search`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from metro.effects.effect import Effect
from metro.loop.fitting.fit import Fit
from metro.loop.fitting.noise import Noise
from metro.loop.search.rivals import Rival
from metro.loop.search.trial import Gates, Trial


@dataclass(frozen=True)
class SearchSpace:
    """What a strategy may choose from, and by which rules.

    Attributes
    ----------
    base : fit of the base model to the identification runs. effects : those that these runs can show.
    prior : the noise before anything is known. gates : thresholds of the configuration.
    least : smallest relative change of the prediction that counts for this observable.
    """

    base: Fit
    effects: tuple[Effect, ...]
    prior: Noise
    gates: Gates
    least: float


@dataclass(frozen=True)
class Choice:
    """What a strategy chose.

    Attributes
    ----------
    fit : with every effect that was chosen, those that are not of the library included.
    steps : the fits on the way to it, in their order. trials : all that was tried, later ones of an effect
        in the place of earlier ones.
    weight : probability of each effect chosen, by its name, against its rivals and against nothing.
    rivals : effects that explain the residual as well as one that was chosen.
    """

    fit: Fit
    steps: tuple[Fit, ...]
    trials: tuple[Trial, ...]
    weight: Mapping[str, float]
    rivals: tuple[Rival, ...]


class Strategy(Protocol):
    """A way to choose effects. It reads the identification runs alone, which are those of the base fit."""

    def __call__(self, space: SearchSpace) -> Choice:
        """Choose effects of a search space."""
        ...
