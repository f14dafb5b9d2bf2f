"""Tool offset: the tip of the tool is not at its declared place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from metro.effects.effect import Effect, EffectParameter
from metro.effects.parts import WithArm
from metro.observables.joint_force.model import JointForceModel
from metro.observables.joint_force.tip import best_tip
from metro.robot.kinematics import FARTHEST_TIP
from metro.units import MM

AXES = ("dx_mm", "dy_mm", "dz_mm")
# Of two tips 0.3 m from the flange in directions that have nothing to do with each other, one component
# differs by 0.3 m √(2/3) rms.
WRONG_ROW_MM = 250.0


def apply(model: WithArm, values: Mapping[str, float]) -> WithArm:
    """Put the tip of the tool elsewhere in the flange frame."""
    offset = np.array([values[name] for name in AXES]) * MM
    return replace(model, arm=model.arm.with_tip_moved(offset))


def adapt(effect: Effect, problem: Any) -> Effect:
    """Start where the torques put the tip, with the gains of the joints as they should be.

    From the declared tip, gains that had to make up for another one may lead astray.
    """
    if not isinstance(problem.base, JointForceModel):
        return effect
    offset, _ = best_tip(problem.base, problem.role("identify"))
    start = np.clip(offset, -FARTHEST_TIP, FARTHEST_TIP) / MM
    parameters = zip(effect.parameters, start.tolist(), strict=True)
    return replace(effect, parameters=tuple(replace(one, starts=(at,)) for one, at in parameters))


EFFECT = Effect(
    name="tool_offset_error",
    observables=("joint_force", "deformation"),
    parameters=tuple(
        EffectParameter(
            name, "mm", -FARTHEST_TIP / MM, FARTHEST_TIP / MM, 1.0, starts=(0.0,), plausible=WRONG_ROW_MM
        )
        for name in AXES
    ),
    apply=apply,
    adapt=adapt,
    part="arm",
    signature=(
        "Torques of the wrist off in proportion to the force, by its lever arm: as large as the offset "
        "against the distance of the joint."
    ),
    literature="[K] eq. 13: the lever arms of the tool in the wrench at the flange",
    experiment="the tip measured by four touches of one point in four orientations",
    remedy="measure the tip of the tool, and correct tool_in_flange_mm in batch.yaml and in the controller",
)
