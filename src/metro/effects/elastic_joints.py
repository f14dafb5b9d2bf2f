"""What an effect of one joint's spring needs of a batch: a model of elastic joints."""

from __future__ import annotations

from metro.effects.effect import Effect
from metro.effects.parts import WithTorsion
from metro.observables.problem import Problem, Refusal


def with_joints(effect: Effect, problem: Problem) -> Effect | Refusal:
    """Return the effect as it is, where the model is one of elastic joints."""
    if not isinstance(problem.base, WithTorsion):
        return Refusal("this prediction is not one of elastic joints")
    return effect
