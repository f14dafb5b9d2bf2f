"""Thermal growth: tool and spindle become longer while a face is cut, so that later passes cut deeper."""

from __future__ import annotations

from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.flatness.model import FlatnessModel
from metro.units import UM

MINUTE = 60.0  # s


def apply(model: FlatnessModel, values: Values) -> FlatnessModel:
    """Let tool and spindle grow by ``um_per_min`` from the start of each face."""
    growth = model.setup.growth + values["um_per_min"] * UM / MINUTE
    return replace(model, setup=replace(model.setup, growth=growth))


EFFECT = Effect(
    name="thermal_growth",
    observables=("flatness",),
    parameters=(EffectParameter("um_per_min", "um/min", -500.0, 500.0, 1.0, starts=(-5.0, 5.0)),),
    apply=apply,
    part="setup",
    signature=(
        "A face that falls from its first pass to its last, at the same rate in time in every face, with a "
        "step where a pass overlaps the one before. Over one face it is a tilt, which a scan that is not "
        "placed in the work frame has anyway."
    ),
    literature="ISO 230-3:2020, tests of thermal effects: distortion by the rotating spindle",
    experiment=(
        "a displacement sensor at the tool while the spindle warms up; or faces whose passes follow each "
        "other along x in some and along y in others, scanned with a declared scanner-to-work transform"
    ),
    remedy="let the spindle warm up before the first pass, or measure the length of the tool between passes",
)
