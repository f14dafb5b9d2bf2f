"""Dynamometer rotation: the sensor is mounted at an angle that differs from the declaration."""

from __future__ import annotations

from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.force.model import ForceModel
from metro.units import DEG


def apply(model: ForceModel, values: Values) -> ForceModel:
    """Turn the sensor by ``angle_deg`` about +z, in addition to what is declared."""
    sensor = replace(model.sensor, rotation=model.sensor.rotation + values["angle_deg"] * DEG)
    return replace(model, sensor=sensor)


EFFECT = Effect(
    name="dynamometer_rotation",
    observables=("force",),
    parameters=(EffectParameter("angle_deg", "deg", -30.0, 30.0, 1.0, starts=(-3.0, 3.0), plausible=5.0),),
    apply=apply,
    belongs_to=("instrument",),
    signature=(
        "Forces in the plane turned by the same angle in every run. K_t and K_r, where they are to be found "
        "from the same forces, take the turn for a change of theirs whatever is cut."
    ),
    literature="a turn of (K_t, K_r) and a turn of (F_x, F_y) are the same thing in a linear force law",
    experiment="a known force along the table's x axis: push the dynamometer with a load cell along a slot",
    remedy=(
        "align the dynamometer with the work, or correct instruments.dynamometer.rotation_deg in batch.yaml"
    ),
)
