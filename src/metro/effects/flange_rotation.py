"""The flange turns where the joints give way and takes the tool along: left out, the tip moves too little."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter
from metro.observables.deformation.model import DeformationModel
from metro.observables.problem import Problem, Refusal


def apply(model: DeformationModel, values: Mapping[str, float]) -> DeformationModel:
    """Let a ``share`` more of what the flange turns move the tip; the whole of it is one."""
    return replace(model, flange_rotation=model.flange_rotation + values["share"])


def _adapted(effect: Effect, problem: Problem) -> Effect | Refusal:
    if not isinstance(problem.base, DeformationModel):
        return Refusal("this prediction is not one of elastic joints")
    if problem.base.flange_rotation == 1.0:
        return Refusal("")  # the base model has it already
    return effect


EFFECT = Effect(
    name="flange_rotation",
    observables=("deformation",),
    parameters=(EffectParameter("share", "1", 0.0, 1.5, 0.05, starts=(0.5, 1.0)),),
    apply=apply,
    signature=(
        "Deformation of the tip, in cuts and load tests alike, that the displacement of the flange does not "
        "account for; most where the tool is long and the joints of the wrist are loaded."
    ),
    literature="[K] equations 16 to 18: the tip moves by the flange's displacement and by ω × p",
    experiment="load tests with displacements read at the flange and at the tip",
    remedy="measure the displacements of load tests at the tip of the tool",
    adapt=_adapted,
)
