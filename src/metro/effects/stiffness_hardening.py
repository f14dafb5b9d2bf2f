"""Stiffness hardening: a joint becomes stiffer with its twist, in the cut and in the load tests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from metro.effects.effect import Effect, EffectParameter, per_joint
from metro.effects.elastic_joints import with_joints
from metro.effects.parts import WithTorsion
from metro.observables.problem import Refusal

# Share of the spring's torque that the cubic part has at the largest torsion of the batch.
STARTS, STEP, MOST = (0.1, 0.5), 0.02, 20.0
NOTHING = 1e-6  # of the largest torsion: rounding


def _of(joint: int) -> Effect:
    def apply(model: WithTorsion, values: Mapping[str, float]) -> WithTorsion:
        return replace(model, torsion=model.torsion.with_joint(joint, cubic=values["cubic"]))

    def adapt(effect: Effect, problem: Any) -> Effect | Refusal:
        if isinstance(refused := with_joints(effect, problem), Refusal):
            return refused
        compliance, twist = problem.base.largest_twists(problem.blocks)
        if twist[joint] <= NOTHING * twist.max():
            return Refusal(f"nothing in this batch twists joint {joint + 1}")
        unit = 1.0 / (compliance[joint] * twist[joint] ** 2)
        return replace(effect, parameters=(_cubic(unit),))

    return Effect(
        name="stiffness_hardening",
        observables=("deformation",),
        parameters=(_cubic(1e11),),
        apply=apply,
        signature=(
            "Load tests and walls that give way less than in proportion to the torque on one joint, "
            "where that torque is large."
        ),
        literature="Tuttle and Seering, IEEE Trans. Robot. Autom. 12 (1996) 368: harmonic drives harden",
        experiment="load tests at a third and at three times the force, where they twist the joint most",
        remedy="make load tests at the forces of the cut, and use the stiffness that the joint has there",
        adapt=adapt,
    )


def _cubic(unit: float) -> EffectParameter:
    """Return the parameter; ``unit``, N m/rad³, doubles the torque at the largest torsion of the batch."""
    return EffectParameter(
        "cubic", "N m/rad3", 0.0, MOST * unit, STEP * unit, starts=tuple(start * unit for start in STARTS)
    )


EFFECT = per_joint(_of)
