"""Tool wear: the edges become blunt with the length cut, so the edge forces grow."""

from __future__ import annotations

from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.force.model import ForceModel
from metro.observables.problem import Problem, Refusal


def apply(model: ForceModel, values: Values) -> ForceModel:
    """Let the edge terms of a force law grow by ``edge_growth_per_m`` with every metre cut."""
    growth = model.law.edge_growth + values["edge_growth_per_m"]
    return replace(model, law=replace(model.law, edge_growth=growth))


def adapt(effect: Effect, problem: Problem) -> Effect | Refusal:
    """Wear needs runs of one batch after different lengths of cut."""
    metres = [block.setting.cut_length for block in problem.role("identify")]
    if max(metres) - min(metres) <= 0.0:
        return Refusal("all runs were made after the same length of cut")
    return effect


EFFECT = Effect(
    name="tool_wear",
    observables=("force",),
    parameters=(EffectParameter("edge_growth_per_m", "1/m", -0.3, 20.0, 0.02, starts=(0.05, 0.5, 3.0)),),
    apply=apply,
    belongs_to=("tool", "work"),
    adapt=adapt,
    signature=(
        "Force that grows along the session by the same amount at every feed, most in the radial and axial "
        "edge terms. Where conditions were cut one after another, their effects cannot be separated from it."
    ),
    literature="Teitenberg, Bayoumi and Yucesan, Wear 154 (1992) 287",
    experiment="the first condition again at the end of the session, with an air cut before and after",
    remedy="change the tool earlier, and do not cut with worn and with new edges in one batch",
)
