"""Missing mode: the impact test did not see one of the modes that the cut excites."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from metro.dynamics.stability_model import StabilityModel
from metro.effects.effect import Effect, EffectParameter, Values
from metro.units import N_UM

AXES = ("x", "y")
# Bounds as multiples of what the impact test found: of its lowest and highest frequency, and of the stiffness
# of its most flexible mode.
FREQUENCIES, STIFFNESSES = (0.4, 2.5), (0.2, 20.0)


def apply(model: StabilityModel, values: Values) -> StabilityModel:
    """Add a mode along ``axis`` (0: x, 1: y) to those of the structure."""
    omega, axis = 2.0 * np.pi * values["frequency_hz"], round(values["axis"])
    stiffness = values["stiffness_n_um"] * N_UM
    return replace(model, structure=model.structure.with_mode(axis, omega, values["damping"], stiffness))


def adapt(effect: Effect, problem: Any) -> Effect:
    """Look for it about the frequencies and stiffnesses of the modes that are known."""
    structures = [case.model.structure for case in problem.cases]
    hz = np.concatenate([structure.omega for structure in structures]) / (2.0 * np.pi)
    softest = min(structure.stiffness.min() for structure in structures) / N_UM
    bounds = {
        "frequency_hz": (FREQUENCIES[0] * hz.min(), FREQUENCIES[1] * hz.max()),
        "stiffness_n_um": (STIFFNESSES[0] * softest, STIFFNESSES[1] * softest),
    }
    fitted = [
        replace(parameter, lower=bounds[parameter.name][0], upper=bounds[parameter.name][1])
        if parameter.name in bounds
        else parameter
        for parameter in effect.parameters
    ]
    return replace(effect, parameters=tuple(fitted))


EFFECT = Effect(
    name="missing_mode",
    observables=("lobes",),
    parameters=(
        EffectParameter("frequency_hz", "Hz", 5.0, 5000.0, 10.0, starts=(50.0, 500.0)),
        EffectParameter("damping", "1", 0.005, 0.15, 0.01, starts=(0.03,)),
        EffectParameter("stiffness_n_um", "N/um", 0.01, 1000.0, 1.0, starts=(10.0,)),
        EffectParameter("axis", "", 0.0, 1.0, 1.0, starts=(0.0, 1.0), choices=AXES),
    ),
    apply=apply,
    signature=(
        "Chatter below the predicted boundary at some speeds, at a frequency near which the impact test has "
        "no mode. Labels without frequencies hardly separate it from turned or softer modes."
    ),
    literature="Altintas, Manufacturing Automation (2012), ch. 4: the boundary is set by every flexible mode",
    experiment=(
        "the chatter frequency of one unstable cut (microphone or dynamometer), and an impact test with a "
        "softer and with a harder tip, on the tool and on the work"
    ),
    remedy="find this mode by an impact test with a hammer tip that excites its frequency, on tool and work",
    adapt=adapt,
)
