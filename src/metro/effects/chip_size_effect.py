"""Size effect: thin chips cost more per area, so the force is a power of the chip thickness."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.force.model import ForceModel
from metro.observables.problem import Problem


def apply(model: ForceModel, values: Values) -> ForceModel:
    """Make K_c of a force law fall with (h/h₀)^−``exponent``; the exponents of several powers add up."""
    exponent = model.law.size_exponent + values["exponent"]
    return replace(model, law=replace(model.law, size_exponent=exponent))


def adapt(effect: Effect, problem: Problem) -> Effect:
    """Count the thickness from the mean chip of the identification runs (contract: signs and zeros)."""
    reference = float(np.mean([mean_chip(block.setting.cut) for block in problem.role("identify")]))

    def apply_here(model: ForceModel, values: Values) -> ForceModel:
        return apply(replace(model, law=replace(model.law, reference_thickness=reference)), values)

    return replace(effect, apply=apply_here)


def mean_chip(cut: Any) -> float:
    """Mean of the chip thickness over the arc of a cut, m."""
    low, high = cut.engagement.entry, cut.engagement.exit
    return float(cut.feed_per_tooth * (math.cos(low) - math.cos(high)) / (high - low))


EFFECT = Effect(
    name="chip_size_effect",
    observables=("force",),
    parameters=(EffectParameter("exponent", "1", -0.3, 0.9, 0.05, starts=(0.1, 0.3)),),
    apply=apply,
    belongs_to=("tool", "work"),
    adapt=adapt,
    signature=(
        "Force that grows less than in proportion to the feed, and a rounder waveform where the chip is "
        "thin. The linear law takes most of it for a larger edge term."
    ),
    literature="Kienzle, VDI-Z 94 (1952) 299; Altintas, Manufacturing Automation, 2nd ed. (2012)",
    experiment="slots at four or more feeds over a factor of five, and side cuts whose chips begin at zero",
    remedy="use these coefficients with their exponent, and do not extrapolate linear ones to thinner chips",
)
