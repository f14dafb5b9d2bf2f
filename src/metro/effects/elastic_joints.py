"""What an effect of one joint's spring needs of a batch: a model of elastic joints."""

from __future__ import annotations

from typing import Any

from metro.effects.effect import Effect
from metro.observables.problem import Refusal


def with_joints(effect: Effect, problem: Any) -> Effect | Refusal:
    """Return the effect as it is, where the model is one of elastic joints."""
    if not hasattr(problem.base, "torsion"):
        return Refusal("this prediction is not one of elastic joints")
    return effect
