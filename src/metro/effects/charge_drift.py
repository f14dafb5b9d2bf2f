"""Charge drift: the zero of a piezoelectric sensor wanders while it measures."""

from __future__ import annotations

from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.force.model import ForceModel

CHANNELS = 3


def apply(model: ForceModel, values: Values) -> ForceModel:
    """Let the zero of each channel drift by ``slope_n_s``, counted from where it was read."""
    slope = tuple(was + more for was, more in zip(model.sensor.slope, values["slope_n_s"], strict=True))
    return replace(model, sensor=replace(model.sensor, slope=slope))


EFFECT = Effect(
    name="charge_drift",
    observables=("force",),
    parameters=tuple(
        EffectParameter("slope_n_s", "N/s", -200.0, 200.0, 1.0, starts=(-3.0, 3.0), group=number)
        for number in range(CHANNELS)
    ),
    apply=apply,
    belongs_to=("instrument",),
    per="axis",
    signature=(
        "A mean that moves along every record by the same newtons per second, in the air as in the cut. "
        "Wear within a run looks alike but needs the cut."
    ),
    literature="Kistler, Piezoelectric Measurement: drift of charge amplifiers",
    experiment="an air cut before and after the same run, as long as the run itself",
    form="slope",
)
