"""Friction reversal: the Coulomb friction of a joint differs from that of the idle run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from metro.effects.effect import Effect, EffectParameter, per_joint
from metro.effects.parts import WithDrives
from metro.robot.drive_torques import PRESLIDING
from metro.robot.presliding import MOST
from metro.units import MRAD


def _following(joint: int) -> Callable[[Effect, Any], Effect]:
    """Return what starts the turn of a joint's friction from that which its idle runs show."""

    def adapt(effect: Effect, problem: Any) -> Effect:
        turn = problem.base.drives.turns(joint + 1)[joint] / MRAD
        level, follows = effect.parameters
        return replace(effect, parameters=(level, replace(follows, starts=(turn, 0.0), neutral=turn)))

    return adapt


def _of(joint: int) -> Effect:
    def apply(model: WithDrives, values: Mapping[str, float]) -> WithDrives:
        drives = model.drives.with_friction(joint, reversal=values["torque_nm"])
        return replace(model, drives=drives.with_presliding(joint, values["presliding_mrad"] * MRAD))

    return Effect(
        name="friction_reversal",
        observables=("joint_force", "deformation", "waviness"),
        parameters=(
            EffectParameter("torque_nm", "N m", -300.0, 300.0, 3.0, starts=(-10.0, 10.0)),
            EffectParameter(
                "presliding_mrad",
                "mrad",
                0.0,
                MOST / MRAD,
                0.05,
                starts=(PRESLIDING / MRAD, 0.0),
                neutral=PRESLIDING / MRAD,
                optional=True,
                nothing_below=True,
                nothing_above=True,
            ),
        ),
        apply=apply,
        adapt=_following(joint),
        part="drives",
        signature=(
            "The torque of one joint has a constant error that changes sign where the joint reverses, over "
            "the turn that friction needs to follow, and the wall has the deviation by which that torque "
            "twists the joint. A joint that turns one way in every run shows a force that does not depend on "
            "the cut."
        ),
        literature="[K] section 4: waviness and force error at the reversal of joint 6",
        experiment="a path on which the joint turns round in the middle of the cut, cut and idle, both ways",
        remedy="make the idle run right before or after the cut, along the same path, with warm joints",
    )


EFFECT = per_joint(_of)
