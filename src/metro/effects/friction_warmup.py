"""Friction warm-up: the Coulomb friction of a joint changes during the cut."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, per_joint
from metro.effects.parts import WithDrives


def _of(joint: int) -> Effect:
    def apply(model: WithDrives, values: Mapping[str, float]) -> WithDrives:
        return replace(model, drives=model.drives.with_friction(joint, warmup=values["slope_nm_s"]))

    return Effect(
        name="friction_warmup",
        observables=("joint_force",),
        parameters=(EffectParameter("slope_nm_s", "N m/s", -50.0, 50.0, 0.3, starts=(-0.5, 0.5)),),
        apply=apply,
        part="drives",
        signature=(
            "Torque of one joint that grows along the log with the sign of the joint's speed, "
            "from nothing at its start."
        ),
        literature="Bittencourt and Gunnarsson, J. Dyn. Sys. Meas. Control 134 (2012) 051013",
        experiment="a long idle run of the same path from cold, and the same after a quarter of an hour",
        remedy=(
            "warm the joints up before the first cut, and make an idle run right before and after each cut"
        ),
    )


EFFECT = per_joint(_of)
