"""A tool or its clamping that yields the more, the deeper it cuts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from metro.dynamics.stability_model import StabilityModel
from metro.effects.effect import Effect, EffectParameter, Values
from metro.units import MM

MOST, USUAL = 2.0, 0.4  # relative growth of the compliance at the depth of the tests, and its deviation


def apply(model: StabilityModel, values: Values) -> StabilityModel:
    """Let every compliance grow by ``growth_per_mm`` (relative) for each millimetre of depth."""
    return replace(model, yielding=model.yielding + values["growth_per_mm"] / MM)


def adapt(effect: Effect, problem: Any) -> Effect:
    """Scale it by the geometric mean of the depths that were tested."""
    depth = float(np.exp(np.mean(np.log(problem.depth)))) / MM
    (parameter,) = effect.parameters
    fitted = replace(parameter, upper=MOST / depth, plausible=USUAL / depth)
    return replace(effect, parameters=(fitted,))


EFFECT = Effect(
    name="depth_yielding",
    observables=("lobes",),
    parameters=(EffectParameter("growth_per_mm", "1", 0.0, 1.0, 0.01, starts=(0.02,), plausible=0.1),),
    apply=apply,
    belongs_to=("tool",),
    resembled=True,  # by labels at few speeds, any tool that is less stiff has the same signature
    signature=(
        "High lobes are lower than predicted, and the chatter frequency is lower where the cut is deep."
    ),
    literature="Kivanc and Budak, Int. J. Mach. Tools Manuf. 44 (2004) 1151: tool, clamping and holder",
    experiment="the chatter frequency of a shallow and of a deep unstable cut at one speed",
    adapt=adapt,
    prior=0.25,  # tools whose clamping yields so much are rarer than spindles that soften
)
