"""Friction reversal: the Coulomb friction of a joint differs from that of the idle run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, per_joint
from metro.effects.parts import WithDrives


def _of(joint: int) -> Effect:
    def apply(model: WithDrives, values: Mapping[str, float]) -> WithDrives:
        return replace(model, drives=model.drives.with_friction(joint, reversal=values["torque_nm"]))

    return Effect(
        name="friction_reversal",
        observables=("joint_force", "deformation", "waviness"),
        parameters=(EffectParameter("torque_nm", "N m", -300.0, 300.0, 3.0, starts=(-10.0, 10.0)),),
        apply=apply,
        part="drives",
        signature=(
            "The torque of one joint has a constant error that changes sign where the joint reverses, and "
            "the "
            "wall has the deviation by which that torque twists the joint. A joint that turns one way in "
            "every run shows a force that does not depend on the cut."
        ),
        literature="[K] section 4: waviness and force error at the reversal of joint 6",
        experiment="a path on which the joint turns round in the middle of the cut, cut and idle, both ways",
    )


EFFECT = per_joint(_of)
