"""Joint backlash: the gear teeth of one joint have a gap, which the force of the cut closes to one side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from metro.effects.effect import Effect, EffectParameter, per_joint
from metro.effects.elastic_joints import with_joints
from metro.effects.parts import WithTorsion
from metro.observables.problem import Refusal
from metro.units import DEG

MDEG = 1e-3 * DEG
WORN = 30.0  # mdeg: gears are made with a gap of up to an arc minute, 17 mdeg, and wear to some of them
# Of the drag, relative to the largest torque of the cuts on the joint: what bearings and seals beyond the gap
# carry is about 1 % of the rated torque, of which a cut loads a joint with a tenth.
PLAUSIBLE = 0.1
MOST, STEP, STARTS = 0.3, 0.02, (0.02, 0.1)  # a drag beyond the most is a spring that is soft, not a gap


def _of(joint: int) -> Effect:
    def apply(model: WithTorsion, values: Mapping[str, float]) -> WithTorsion:
        torsion = model.torsion.with_joint(
            joint, gap=values["angle_mdeg"] * MDEG, drag=values.get("drag_nm", 0.0)
        )
        return replace(model, torsion=torsion)

    def adapt(effect: Effect, problem: Any) -> Effect | Refusal:
        if isinstance(refused := with_joints(effect, problem), Refusal):
            return refused
        largest = float(problem.base.largest_in_cut(problem.blocks)[joint])
        gap = effect.parameters[0]
        return replace(effect, parameters=(gap, _drag(largest)) if largest > 0.0 else (gap,))

    return Effect(
        name="joint_backlash",
        observables=("deformation", "waviness"),
        parameters=(
            EffectParameter("angle_mdeg", "mdeg", 0.0, 500.0, 1.0, starts=(5.0, 30.0), plausible=WORN),
            _drag(100.0),
        ),
        apply=apply,
        signature=(
            "An offset of the wall that does not grow with the force, and changes its sign where the joint's "
            "torque does. Cuts that load the joints alike show it for every joint alike."
        ),
        literature="Ruderman, Hoffmann and Bertram, IEEE Trans. Ind. Electron. 56 (2009) 3840: joint gaps",
        experiment=(
            "two cuts of different depth in a pose in which the joint's torque has the other sign than here"
        ),
        remedy=(
            "have the gear of this joint adjusted, or place the cut so that the joint's torque keeps its sign"
        ),
        adapt=adapt,
    )


def _drag(largest: float) -> EffectParameter:
    """Return the torque that holds a link within its gap, of a joint with a ``largest`` torque, N m."""
    return EffectParameter(
        "drag_nm",
        "N m",
        0.0,
        MOST * largest,
        STEP * largest,
        starts=tuple(start * largest for start in STARTS),
        plausible=PLAUSIBLE * largest,
        optional=True,
    )


EFFECT = per_joint(_of)
