"""Charge leak: a piezoelectric sensor discharges, so that a steady force fades from its signal."""

from __future__ import annotations

from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.force.model import ForceModel

CHANNELS = 3
NEVER = 1e4  # s


def apply(model: ForceModel, values: Values) -> ForceModel:
    """Discharge each channel with its ``time_constant_s``; the rates of several leaks add up."""
    leaks = zip(model.sensor.discharge, values["time_constant_s"], strict=True)
    discharge = tuple(was + 1.0 / constant for was, constant in leaks)
    return replace(model, sensor=replace(model.sensor, discharge=discharge))


EFFECT = Effect(
    name="charge_drift",
    observables=("force",),
    parameters=tuple(
        EffectParameter(
            "time_constant_s",
            "s",
            0.02,
            NEVER,
            1.0,
            starts=(0.5, 3.0, 20.0),
            group=number,
            neutral=NEVER,
            reciprocal=True,
        )
        for number in range(CHANNELS)
    ),
    apply=apply,
    belongs_to=("instrument",),
    per="axis",
    signature="A mean that fades along every record in proportion to itself, and undershoots after the cut.",
    literature="Kistler, Piezoelectric Measurement: time constant of a charge amplifier",
    experiment="a cut of at least half the time constant, with air before and after it",
    remedy=(
        "set the charge amplifier to its long time constant, dry its connectors, and zero it before every run"
    ),
    form="discharge",
)
