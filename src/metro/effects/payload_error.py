"""Payload error: the flange carries a mass in the cut that it did not carry in the idle run."""

from __future__ import annotations

from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.joint_force.model import JointForceModel
from metro.robot.payload import Payload
from metro.units import MM


def apply(model: JointForceModel, values: Values) -> JointForceModel:
    """Hang one more mass at a place in the flange frame."""
    x, y, z = (coordinate * MM for coordinate in values["com_mm"])
    return replace(model, payload=(*model.payload, Payload(values["mass_kg"], (x, y, z))))


EFFECT = Effect(
    name="payload_error",
    observables=("joint_force",),
    parameters=(
        EffectParameter("mass_kg", "kg", -100.0, 100.0, 0.5, starts=(-3.0, 3.0)),
        *(
            EffectParameter("com_mm", "mm", -1000.0, 1000.0, 50.0, starts=(0.0,), plausible=150.0)
            for _ in range(3)
        ),
    ),
    apply=apply,
    part="payload",
    signature=(
        "Torques that are there in the air, too, constant along a short path, in the proportions of a weight "
        "on the flange."
    ),
    literature="Swevers, Verdonck and De Schutter, IEEE Control Systems 27 (2007) 58",
    experiment="an idle run with the tool and chips as in the cut, in two orientations of the wrist",
    remedy=(
        "make the idle run with the same tool, hoses and chips as the cut, "
        "and correct the payload in the controller"
    ),
)
