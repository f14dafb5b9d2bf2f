"""Tool runout: the axis of the tool is not the axis of rotation, so the teeth cut unequal chips."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter
from metro.effects.phasor import phasor_sum
from metro.observables.force.model import ForceModel
from metro.units import DEG, UM


def apply(model: ForceModel, values: Mapping[str, float]) -> ForceModel:
    """Move the cutter of a force model by ``radius_um`` towards ``angle_deg``, clockwise from tooth 0."""
    radius, angle = phasor_sum(
        model.cutter.runout_radius,
        model.cutter.runout_angle,
        values["radius_um"] * UM,
        values["angle_deg"] * DEG,
    )
    return replace(model, cutter=replace(model.cutter, runout_radius=radius, runout_angle=angle))


EFFECT = Effect(
    name="tool_runout",
    observables=("force",),
    parameters=(
        EffectParameter("radius_um", "um", 0.0, 200.0, 5.0, starts=(4.0, 20.0), plausible=10.0),
        EffectParameter(
            "angle_deg",
            "deg",
            0.0,
            360.0,
            30.0,
            starts=tuple(15.0 + 30.0 * i for i in range(12)),
            period=360.0,
            length="radius_um",
        ),
    ),
    apply=apply,
    belongs_to=("tool",),
    signature=(
        "Force at spindle orders that are not multiples of the number of teeth. The first order does not "
        "depend on the feed, and the mean is unchanged while every tooth cuts. A chipped tooth and unequal "
        "pitch have similar signatures, but grow with the feed."
    ),
    literature=(
        "Kline and DeVor, Int. J. Mach. Tool Des. Res. 23 (1983) 123; "
        "extended to teeth that clear what several earlier ones left"
    ),
    experiment=(
        "runs at two feeds that differ by a factor of two or more, "
        "at a sampling rate above ten tooth passings"
    ),
    remedy="clean and clamp the tool anew, check it with a dial gauge, and change the holder if it remains",
)
