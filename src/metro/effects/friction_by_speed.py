"""A joint whose viscous friction is not that of the idle run: cold or warm grease, another speed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, per_joint
from metro.effects.parts import WithDrives


def _of(joint: int) -> Effect:
    def apply(model: WithDrives, values: Mapping[str, float]) -> WithDrives:
        return replace(model, drives=model.drives.with_friction(joint, viscous=values["torque_nm_s"]))

    return Effect(
        name="friction_by_speed",
        observables=("joint_force",),
        parameters=(EffectParameter("torque_nm_s", "N m s/rad", -2e4, 2e4, 100.0, starts=(-300.0, 300.0)),),
        apply=apply,
        part="drives",
        resembled=True,  # at one speed it is a change of the Coulomb level, too
        signature=(
            "Torque of one joint off in proportion to its speed. A joint that turns at nearly one speed "
            "shows the same as with another Coulomb friction."
        ),
        literature="Bittencourt and Gunnarsson, J. Dyn. Sys. Meas. Control 134 (2012) 051013",
        experiment="idle runs of the path at half and at twice the feed, cold and warm",
    )


EFFECT = per_joint(_of)
