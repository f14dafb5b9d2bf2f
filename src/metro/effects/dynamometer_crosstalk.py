"""Dynamometer crosstalk: a channel reads a part of the force along the others, or its gain is another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.force.model import ForceModel

X, Y, Z = range(3)
# Row and column of the sensor's matrix that each share changes. What is turned within the plane is another
# effect, and the gains of x and z are taken for coefficients: neither is identifiable from forces of a cut.
ENTRIES = {
    "x_in_z_percent": ((Z, X),),
    "y_in_z_percent": ((Z, Y),),
    "z_in_x_percent": ((X, Z),),
    "z_in_y_percent": ((Y, Z),),
    "x_and_y_percent": ((X, Y), (Y, X)),
    "y_gain_percent": ((Y, Y),),
}
USUAL = 2.0  # %: data sheets of piezoelectric dynamometers state 1 to 3


def apply(model: ForceModel, values: Values) -> ForceModel:
    """Let each channel read shares of the force along the others, and y more or less of its own."""
    matrix = np.array(model.sensor.crosstalk)
    for name, places in ENTRIES.items():
        for place in places:
            matrix[place] += 0.01 * values[name]
    crosstalk = tuple(tuple(row) for row in matrix.tolist())
    return replace(model, sensor=replace(model.sensor, crosstalk=crosstalk))


EFFECT = Effect(
    name="dynamometer_crosstalk",
    observables=("force",),
    parameters=tuple(
        EffectParameter(name, "%", -15.0, 15.0, 0.5, starts=(1.0,), plausible=USUAL) for name in ENTRIES
    ),
    apply=apply,
    belongs_to=("instrument",),
    signature=(
        "The waveform of one axis in another, by the same share in every run and at all orders. In a hole "
        "the forces of the plane turn with the orbit: their share in z comes and goes once per orbit."
    ),
    literature="Kistler, data sheets of multicomponent dynamometers: crosstalk of up to 2 to 3 %",
    experiment="a known force along each axis of the table in turn, all channels recorded",
    remedy=(
        "calibrate the dynamometer with the work on it, or declare the crosstalk under known in batch.yaml"
    ),
)
