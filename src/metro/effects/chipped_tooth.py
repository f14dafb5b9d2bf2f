"""A chipped tooth: not of the library; the loop knows it so that it takes nothing else for it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from metro.cutting.chipped import Chipped
from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.force.model import ForceModel
from metro.observables.problem import Problem, Refusal
from metro.units import MM, UM


def apply(model: ForceModel, values: Values) -> ForceModel:
    """Break ``length_um`` off the ``tooth`` (its number; the nearest whole one), up to ``height_mm``."""
    chip = Chipped(round(values["tooth"]), values["length_um"] * UM, values["height_mm"] * MM)
    return replace(model, chipped=(*model.chipped, chip))


def adapt(effect: Effect, problem: Problem) -> Effect | Refusal:
    """Try each tooth, chipped up to some of the depth of cut."""
    base: Any = problem.base
    teeth = base.cutter.teeth
    if teeth < 2:
        return Refusal("the tool has one tooth")
    cuts: list[Any] = [block.setting for block in problem.role("identify")]
    depth = float(np.median([setting.cut.axial_depth for setting in cuts])) / MM
    length, tooth, height = effect.parameters
    return replace(
        effect,
        parameters=(
            length,
            replace(tooth, upper=teeth - 1.0, starts=tuple(float(j) for j in range(teeth))),
            replace(height, upper=2.0 * depth, scale=0.1 * depth, starts=(0.35 * depth, 0.8 * depth)),
        ),
    )


EFFECT = Effect(
    name="chipped_tooth",
    observables=("force",),
    parameters=(
        EffectParameter("length_um", "um", 0.0, 500.0, 10.0, starts=(10.0, 40.0), plausible=50.0),
        EffectParameter("tooth", "1", 0.0, 1.0, 1.0, starts=(0.0, 1.0)),
        EffectParameter("height_mm", "mm", 0.05, 50.0, 0.5, starts=(0.5, 2.0)),
    ),
    apply=apply,
    belongs_to=("tool",),
    comparable=False,  # which tooth is the first differs from batch to batch
    adapt=adapt,
    resembled=True,
    signature=(
        "Force at spindle orders that are not multiples of the number of teeth: over part of the depth, one "
        "tooth cuts less and the next cuts more. Runout has a similar signature, but involves all teeth."
    ),
    literature="Altintas and Yellowley, J. Eng. Ind. 111 (1989) 157: detection of tooth failure in milling",
    experiment="the teeth under a microscope",
)
