"""Uneven teeth: teeth that reach differently far, by more than an offset axis makes of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from metro.effects.effect import Effect, EffectParameter, Values
from metro.effects.pitch_error import by_tooth
from metro.observables.force.model import ForceModel
from metro.observables.problem import Problem, Refusal
from metro.units import UM

FIRST = 2  # wave around the tool from which on unequal teeth are no offset of its axis


def apply(model: ForceModel, values: Values) -> ForceModel:
    """Let each tooth reach farther out by its ``longer_um``."""
    reach = np.array(model.cutter.reach or (0.0,)) + np.array(values["longer_um"]) * UM
    return replace(model, cutter=replace(model.cutter, reach=tuple(float(each) for each in reach)))


def adapt(effect: Effect, problem: Problem) -> Effect | Refusal:
    """Give each tooth its deviation, without what a change of the diameter or an offset of the axis makes."""
    base: Any = problem.base
    teeth = base.cutter.teeth
    if teeth < 2 * FIRST:
        reason = "an offset of the axis makes every difference in length of three teeth or fewer"
        return Refusal(f"{reason}: declare tool_runout instead", moot=True)
    return by_tooth(effect, teeth, FIRST)


EFFECT = Effect(
    name="uneven_teeth",
    observables=("force",),
    parameters=(EffectParameter("longer_um", "um", -100.0, 100.0, 2.0, starts=(-3.0, 3.0), plausible=5.0),),
    apply=apply,
    belongs_to=("tool",),
    comparable=False,  # which tooth is the first differs from batch to batch
    per="tooth",
    adapt=adapt,
    signature=(
        "Force at spindle orders that are not multiples of the number of teeth, at others than those of "
        "runout: of four teeth, at order 2. It does not depend on the feed; that of pitch errors does."
    ),
    literature=(
        "Fu, DeVor and Kapoor, J. Eng. Ind. 106 (1984) 81: throws of the single inserts of a face mill"
    ),
    experiment="runs at two feeds that differ by a factor of two or more, and each tooth under a dial gauge",
    remedy="have the tool reground or its inserts set, and check each tooth on a presetter",
)
