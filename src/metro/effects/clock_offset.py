"""Clock offset: the clock of the robot differs from that of the dynamometer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from metro.effects.effect import Effect, EffectParameter
from metro.observables.arm.clock import clock
from metro.observables.joint_force.model import JointForceModel
from metro.units import MS

NEAR = (-60.0, -10.0, 10.0, 60.0)  # an entry into the work takes longer than they are apart


def apply(model: JointForceModel, values: Mapping[str, float]) -> JointForceModel:
    """Let the log of the cut stamp an event ``offset_ms`` later than the dynamometer does."""
    return replace(model, offset=model.offset + values["offset_ms"] * MS)


def with_the_clocks(effect: Effect, problem: Any) -> Effect:
    """Start where the torques of most runs rise and fall with the force, too: it may be an entry away."""
    runs = problem.role("identify")
    late = float(np.median([clock(run, problem.base.arm, 1.0).offset for run in runs])) / MS if runs else 0.0
    offset = effect.parameters[0]
    return replace(effect, parameters=(replace(offset, starts=(*NEAR, late)),))


EFFECT = Effect(
    name="clock_offset",
    observables=("joint_force",),
    parameters=(EffectParameter("offset_ms", "ms", -2000.0, 2000.0, 5.0, starts=NEAR),),
    apply=apply,
    belongs_to=("instrument",),
    part="offset",
    signature=(
        "Torques that follow the force by a constant time: seen where the tool enters and leaves the work, "
        "and nowhere in the steady cut."
    ),
    literature="[K] section 3.1: logs of controller and data acquisition without a common clock",
    experiment="a cut with several entries (a stepped block) at the highest feed, force and log together",
    adapt=with_the_clocks,
    remedy="start the robot's log and the dynamometer by one trigger, or synchronise their clocks",
)
