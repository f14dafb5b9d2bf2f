"""A tip that gives way by itself in the cut: tool, holder and spindle, or a link that no load test bends."""

from __future__ import annotations

from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.deformation.model import DeformationModel
from metro.units import UM


def apply(model: DeformationModel, values: Values) -> DeformationModel:
    """Let the tip give way along the wall's normal by ``um_per_kn`` of the force that way."""
    return replace(model, give=model.give + values["um_per_kn"] * UM / 1e3)


EFFECT = Effect(
    name="tip_give",
    observables=("deformation",),
    parameters=(EffectParameter("um_per_kn", "um", 0.0, 2000.0, 5.0, starts=(20.0,)),),
    apply=apply,
    belongs_to=("cell", "tool"),
    part="give",
    resembled=True,  # of what is soft between flange and edge, the walls say nothing
    signature=(
        "Deformation in proportion to the force on the wall, whatever the pose of the arm. Where all cuts "
        "are in one pose, joints that are softer than in the load tests have the same signature."
    ),
    literature="Kivanc and Budak, Int. J. Mach. Tools Manuf. 44 (2004) 1151: tool, clamping and holder",
    experiment="load tests with force and displacement at the edge of the tool, not at the flange",
)
