"""Orbit stiffness: the stiffness of a robot, and with it the axial force, varies around a helical hole."""

from __future__ import annotations

from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, Values
from metro.effects.phasor import phasor_sum
from metro.observables.force.model import ForceModel
from metro.observables.problem import Problem, Refusal
from metro.units import DEG


def apply(model: ForceModel, values: Values) -> ForceModel:
    """Let the axial force of helical runs vary with the direction of feed: waves over one orbit add up."""
    structure = model.structure
    amplitude, phase = phasor_sum(
        structure.orbit_amplitude, structure.orbit_phase, values["amplitude"], values["phase_deg"] * DEG
    )
    return replace(model, structure=replace(structure, orbit_amplitude=amplitude, orbit_phase=phase))


def adapt(effect: Effect, problem: Problem) -> Effect | Refusal:
    """Only helical runs show it, and no other is changed by it."""
    if not any(block.setting.helix for block in problem.blocks):
        return Refusal("no run is helical", moot=True)
    if not any(block.setting.helix for block in problem.role("identify")):
        return Refusal("no helical run is among those of the identification")
    return effect


EFFECT = Effect(
    name="orbit_stiffness",
    observables=("force",),
    parameters=(
        EffectParameter("amplitude", "1", 0.0, 1.0, 0.02, starts=(0.03, 0.15)),
        EffectParameter(
            "phase_deg",
            "deg",
            -180.0,
            180.0,
            20.0,
            starts=tuple(45.0 * i for i in range(-4, 4)),
            period=360.0,
            length="amplitude",
        ),
    ),
    apply=apply,
    adapt=adapt,
    signature="Axial force of helical runs that rises and falls once per orbit, the same way in each hole.",
    literature="a parallel kinematic machine is not equally stiff all over its workspace",
    experiment="a hole at each of two places of the workspace, and one with the orbit reversed",
    remedy="place the hole where the arm is stiffer, or declare this change under known in batch.yaml",
)
