"""Passes set higher or lower than programmed: a step of the tool, a missed depth, a growth that ends."""

from __future__ import annotations

from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.flatness.model import FlatnessModel
from metro.units import UM

DEGREES = 5


def apply(model: FlatnessModel, values: Values) -> FlatnessModel:
    """Set each pass of a face higher by a polynomial over the order of the passes, the same in all faces."""
    was = model.setup.levels or (0.0,) * DEGREES
    levels = tuple(one + values[f"degree_{i}_um"] * UM for i, one in enumerate(was, start=1))
    return replace(model, setup=replace(model.setup, levels=levels))


EFFECT = Effect(
    name="pass_levels",
    observables=("flatness",),
    parameters=tuple(
        EffectParameter(f"degree_{i}_um", "um", -1000.0, 1000.0, 1.0, starts=(0.0,))
        for i in range(1, DEGREES + 1)
    ),
    apply=apply,
    part="setup",
    prior=0.2,  # it holds a steady growth, too: where that is all, the growth is to be believed
    resembled=True,  # what sets a pass higher, and the next one not, the faces do not say
    signature=(
        "Steps between passes, alike in every face, as a function of the order of the passes. A steady "
        "growth of the tool is the simplest of them."
    ),
    literature="ISO 230-3:2020, tests of thermal effects: drift ends when a steady state is reached",
    experiment="a displacement sensor at the tool through a face, and the tool's length before and after",
)
