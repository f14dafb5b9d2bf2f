"""Fixture bow: the clamped work is bent while it is cut, or springs back, so that the face is curved."""

from __future__ import annotations

import math
from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.flatness.model import FlatnessModel
from metro.observables.problem import Problem, Refusal
from metro.units import UM

NAMES = ("xx_um", "xy_um", "yy_um")


def apply(model: FlatnessModel, values: Values) -> FlatnessModel:
    """Add xx u² + xy u v + yy v² to the height, with u, v from −1 to 1 over the work."""
    bow = tuple(was + values[name] * UM for was, name in zip(model.setup.bow, NAMES, strict=True))
    return replace(model, setup=replace(model.setup, bow=bow))


def adapt(effect: Effect, problem: Problem) -> Effect | Refusal:
    """Refuse where the size of the work, over which a bow is stated, is not given."""
    known = all(math.isfinite(size) for block in problem.role("identify") for size in block.setting.size)
    return effect if known else Refusal("work.size_mm, over which a bow is stated, is not given")


EFFECT = Effect(
    name="fixture_bow",
    observables=("flatness",),
    parameters=tuple(EffectParameter(name, "um", -1000.0, 1000.0, 1.0, starts=(0.0,)) for name in NAMES),
    apply=apply,
    part="setup",
    adapt=adapt,
    signature=(
        "The same curvature over the work in every face, whatever the depth of cut, the direction of the "
        "passes and the pose. A stiffness that varies over the face is similar, but scales with the force."
    ),
    literature="Nee, Tao and Kumar, An Advanced Treatise on Fixture Design and Planning (2004)",
    experiment="the face scanned clamped and released; or faces at a third and three times the depth of cut",
    remedy="support the work beneath where it is clamped, clamp it less, and release it before the last cut",
)
