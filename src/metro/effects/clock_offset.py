"""Clock offset: the clock of the robot differs from that of the dynamometer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter
from metro.observables.joint_force.model import JointForceModel
from metro.units import MS

STARTS = (-300.0, -60.0, -10.0, 10.0, 60.0, 300.0)


def apply(model: JointForceModel, values: Mapping[str, float]) -> JointForceModel:
    """Let the log of the cut stamp an event ``offset_ms`` later than the dynamometer does."""
    return replace(model, offset=model.offset + values["offset_ms"] * MS)


EFFECT = Effect(
    name="clock_offset",
    observables=("joint_force",),
    parameters=(EffectParameter("offset_ms", "ms", -2000.0, 2000.0, 5.0, starts=STARTS),),
    apply=apply,
    belongs_to=("instrument",),
    part="offset",
    signature=(
        "Torques that follow the force by a constant time: seen where the tool enters and leaves the work, "
        "and nowhere in the steady cut."
    ),
    literature="[K] section 3.1: logs of controller and data acquisition without a common clock",
    experiment="a cut with several entries (a stepped block) at the highest feed, force and log together",
    remedy="start the robot's log and the dynamometer by one trigger, or synchronise their clocks",
)
