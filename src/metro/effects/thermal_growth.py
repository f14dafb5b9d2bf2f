"""Thermal growth: tool and spindle become longer while a face is cut, so that later passes cut deeper.

A spindle that warms up grows fast at first and levels off, with a time constant of minutes. Over a face that
takes much less, its growth is as good as steady: which of the two a batch shows, it says itself.
"""

from __future__ import annotations

import math
from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.flatness.model import FlatnessModel
from metro.units import UM

MINUTE = 60.0  # s


def apply(model: FlatnessModel, values: Values) -> FlatnessModel:
    """Let tool and spindle grow by ``um_per_min`` in the first minute of each face.

    The growth is steady, or levels off with the time constant ``settles_s``.
    """
    settles = values.get("settles_s", math.inf)
    growth = (values["um_per_min"] * UM, settles)
    return replace(model, setup=replace(model.setup, growth=(*model.setup.growth, growth)))


RATE = EffectParameter("um_per_min", "um/min", -500.0, 500.0, 1.0, starts=(-5.0, 5.0))
# Noses of spindles settle within 1 to 4 minutes, housings within 8 to 40 (ISO 230-3 tests). Of what settles
# faster than a pass is cut, the first pass says nothing but its height.
SETTLES = EffectParameter("settles_s", "s", 5.0, 3000.0, 5.0, starts=(40.0, 200.0))

STEADY = Effect(
    name="thermal_growth",
    observables=("flatness",),
    parameters=(RATE,),
    apply=apply,
    part="setup",
    prior=0.5,
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
LEVELLING_OFF = replace(
    STEADY,
    parameters=(RATE, SETTLES),
    form="levelling off",
    signature=(
        "A face that falls from pass to pass, in time, less and less: the first passes differ most in "
        "height. Over one face the bend stays where a tilt does not count."
    ),
)
EFFECT = (STEADY, LEVELLING_OFF)
