"""Walls that lie ever further off in the order of cutting: what a machine that warms up, or a table, does."""

from __future__ import annotations

from dataclasses import replace

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.deformation.model import DeformationModel
from metro.units import UM


def apply(model: DeformationModel, values: Values) -> DeformationModel:
    """Let the tip move by ``x_um_per_run`` and ``y_um_per_run`` (work frame) from each run to the next."""
    x, y = model.drift
    return replace(model, drift=(x + values["x_um_per_run"] * UM, y + values["y_um_per_run"] * UM))


EFFECT = Effect(
    name="tip_drift",
    observables=("deformation",),
    parameters=tuple(
        EffectParameter(f"{axis}_um_per_run", "um", -500.0, 500.0, 0.2, starts=(1.0,)) for axis in "xy"
    ),
    apply=apply,
    part="drift",
    resembled=True,  # of what drifts, and when, the walls say nothing: arm, work and room all do
    signature=(
        "The deviation of the walls grows from run to run, in one direction of the work frame and whatever "
        "the force. Where one load always comes late in the session, backlash of a joint is similar."
    ),
    literature="ISO 230-3:2020, tests of thermal effects: drift of the tool against the work",
    experiment="the first cut once more at the end of the session, and the tip against a fixed gauge between",
)
