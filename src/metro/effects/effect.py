"""What an effect is: a named change of one part of a model, with a few parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class EffectParameter:
    """A parameter of an effect.

    Attributes
    ----------
    name, unit : as in the contract's table of effects, e.g. ``radius_um`` in ``um``; values are given in this
        unit.
    lower, upper : bounds of the search.
    scale : a typical size: the step of the search and the yardstick of "not zero".
    starts : values from which the joint refit starts; all combinations over the parameters are tried.
    plausible : standard deviation of a weak prior about zero (None: flat): of two explanations that the data
        cannot part, the one that a machinist would believe.
    period : for an angle, the period after which the model is the same; None otherwise.
    """

    name: str
    unit: str
    lower: float
    upper: float
    scale: float
    starts: tuple[float, ...]
    period: float | None = None
    plausible: float | None = None


@dataclass(frozen=True)
class Effect:
    """A cause that a base model may lack.

    Attributes
    ----------
    name : as in the contract.
    observables : names of the observables whose models have the part that it changes.
    parameters : its parameters, in the units of the contract.
    apply : ``apply(model, values) -> model``; ``values`` maps parameter names to numbers in their own units.
    signature : one sentence: where it is seen, and what resembles it.
    literature : where the model of the effect comes from.
    experiment : the measurement that would show it best, for "measure this next".
    """

    name: str
    observables: tuple[str, ...]
    parameters: tuple[EffectParameter, ...]
    apply: Callable[[Any, Mapping[str, float]], Any]
    signature: str
    literature: str
    experiment: str
