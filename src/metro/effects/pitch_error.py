"""Pitch error: teeth that are not where they should be cut chips of different feed."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.force.model import ForceModel
from metro.observables.problem import Problem, Refusal
from metro.units import DEG


def apply(model: ForceModel, values: Values) -> ForceModel:
    """Turn each tooth by its ``pitch_deg``, clockwise."""
    turned = np.array(model.cutter.tooth_angles) + np.array(values["pitch_deg"]) * DEG
    return replace(model, cutter=replace(model.cutter, tooth_angles=tuple(float(a) for a in turned)))


def by_tooth(effect: Effect, teeth: int, first: int = 1) -> Effect:
    """Give each tooth its deviation, of waves around the tool from the ``first`` on: these add up to nothing.

    An effect has as many parameters as there are such waves, one less than teeth from the first on.
    """
    waves = [
        [math.sqrt(2.0 / teeth) * wave(2.0 * math.pi * (k * j) / teeth) for j in range(teeth)]
        for k in range(first, teeth // 2 + 1)
        for wave in ((math.cos,) if 2 * k == teeth else (math.cos, math.sin))
    ]
    return replace(
        effect,
        parameters=tuple(replace(effect.parameters[0]) for _ in waves),
        mixing=tuple(zip(*waves, strict=True)),
    )


def adapt(effect: Effect, problem: Problem) -> Effect | Refusal:
    """Give each tooth its deviation; they add up to nothing, so there is one parameter less than teeth."""
    base: Any = problem.base
    teeth = base.cutter.teeth
    return by_tooth(effect, teeth) if teeth > 1 else Refusal("the tool has one tooth")


EFFECT = Effect(
    name="pitch_error",
    observables=("force",),
    parameters=(EffectParameter("pitch_deg", "deg", -15.0, 15.0, 0.5, starts=(-0.7, 0.7), plausible=2.0),),
    apply=apply,
    belongs_to=("tool",),
    comparable=False,  # which tooth is the first differs from batch to batch
    per="tooth",
    adapt=adapt,
    signature=(
        "Force at spindle orders that are not multiples of the number of teeth, in proportion to the feed. "
        "Runout has a similar signature but does not depend on the feed."
    ),
    literature="Altintas, Engin and Budak, J. Manuf. Sci. Eng. 121 (1999) 173: cutters with variable pitch",
    experiment="runs at two feeds that differ by a factor of three or more, and the pitch under a microscope",
    remedy="measure the pitch under a microscope, and enter it as tool.pitch_deg in batch.yaml",
)
