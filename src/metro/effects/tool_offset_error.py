"""Tool offset: the tip of the tool is not at its declared place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from metro.effects.effect import Effect, EffectParameter
from metro.effects.parts import WithArm
from metro.units import MM

AXES = ("dx_mm", "dy_mm", "dz_mm")


def apply(model: WithArm, values: Mapping[str, float]) -> WithArm:
    """Put the tip of the tool elsewhere in the flange frame."""
    moved = model.arm.tool + np.array([values[name] for name in AXES]) * MM
    return replace(model, arm=replace(model.arm, tool=moved))


EFFECT = Effect(
    name="tool_offset_error",
    observables=("joint_force", "deformation"),
    parameters=tuple(
        EffectParameter(name, "mm", -200.0, 200.0, 1.0, starts=(0.0,), plausible=60.0) for name in AXES
    ),
    apply=apply,
    part="arm",
    signature=(
        "Torques of the wrist off in proportion to the force, by its lever arm: as large as the offset "
        "against the distance of the joint."
    ),
    literature="[K] eq. 13: the lever arms of the tool in the wrench at the flange",
    experiment="the tip measured by four touches of one point in four orientations",
)
