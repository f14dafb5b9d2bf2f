"""A form of third degree in every face: a distorted scanner, a rail that sags, work that is no simple bow."""

from __future__ import annotations

from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, Values
from metro.effects.fixture_bow import adapt
from metro.observables.flatness.model import FlatnessModel
from metro.units import UM

NAMES = ("uuu_um", "uuv_um", "uvv_um", "vvv_um")


def apply(model: FlatnessModel, values: Values) -> FlatnessModel:
    """Add uuu u³ + uuv u² v + uvv u v² + vvv v³ to the height, with u, v from −1 to 1 over the work."""
    cubic = tuple(was + values[name] * UM for was, name in zip(model.setup.cubic, NAMES, strict=True))
    return replace(model, setup=replace(model.setup, cubic=cubic))


EFFECT = Effect(
    name="cubic_form",
    observables=("flatness",),
    parameters=tuple(EffectParameter(name, "um", -1000.0, 1000.0, 1.0, starts=(0.0,)) for name in NAMES),
    apply=apply,
    belongs_to=("cell", "instrument"),
    part="setup",
    adapt=adapt,
    prior=0.5,
    resembled=True,  # of a scanner, a rail or the work: faces scanned one way do not say which
    signature="The same twisted form over the work in every face, whatever the depth, direction and pose.",
    literature="ISO 10360-13:2021: form measured by an optical sensor on a flat, over its whole field",
    experiment="the same face scanned turned by half a turn: what turns with it is the work's",
)
