"""Spindle tilt: the spindle is not perpendicular to the plane of the passes, so each pass is a groove."""

from __future__ import annotations

from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.flatness.model import FlatnessModel
from metro.units import MRAD


def apply(model: FlatnessModel, values: Values) -> FlatnessModel:
    """Turn the spindle about work x and y through the tool's tip, right-handed."""
    about_x, about_y = model.setup.tilt
    tilt = (about_x + values["about_x_mrad"] * MRAD, about_y + values["about_y_mrad"] * MRAD)
    return replace(model, setup=replace(model.setup, tilt=tilt))


def _angle(name: str) -> EffectParameter:
    # Which side of the rim cuts deeper changes with the sign: both are tried.
    return EffectParameter(name, "mrad", -20.0, 20.0, 0.1, starts=(-0.7, 0.7), plausible=5.0)


EFFECT = Effect(
    name="spindle_tilt",
    observables=("flatness",),
    parameters=(_angle("about_x_mrad"), _angle("about_y_mrad")),
    apply=apply,
    part="setup",
    signature=(
        "The same groove along every pass, dished for a tilt against the feed, a saw tooth from pass to pass "
        "for one across it. Along the middle of the passes it is an offset alone, as of the scan's place."
    ),
    literature="Gu et al., J. Manuf. Sci. Eng. 119 (1997) 476: flatness with spindle tilt",
    experiment="a dial gauge in the spindle swept over a ground plate; or one face cut in both directions",
    remedy="tram the spindle: correct its orientation to the table by these angles",
)
