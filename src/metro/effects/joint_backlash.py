"""Joint backlash: the gear teeth of one joint have a gap, which the force of the cut closes to one side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, per_joint
from metro.effects.elastic_joints import with_joints
from metro.effects.parts import WithTorsion
from metro.units import DEG

MDEG = 1e-3 * DEG


def _of(joint: int) -> Effect:
    def apply(model: WithTorsion, values: Mapping[str, float]) -> WithTorsion:
        return replace(model, torsion=model.torsion.with_joint(joint, gap=values["angle_mdeg"] * MDEG))

    return Effect(
        name="joint_backlash",
        observables=("deformation", "waviness"),
        parameters=(EffectParameter("angle_mdeg", "mdeg", 0.0, 500.0, 1.0, starts=(5.0, 30.0)),),
        apply=apply,
        signature=(
            "An offset of the wall that does not grow with the force, and changes its sign where the joint's "
            "torque does. Cuts that load the joints alike show it for every joint alike."
        ),
        literature="Ruderman, Hoffmann and Bertram, IEEE Trans. Ind. Electron. 56 (2009) 3840: joint gaps",
        experiment=(
            "two cuts of different depth in a pose in which the joint's torque has the other sign than here"
        ),
        adapt=with_joints,
    )


EFFECT = per_joint(_of)
