"""Speed softening: the stiffness of the spindle at speed differs from that of the hammer test at rest."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from metro.dynamics.stability_model import StabilityModel
from metro.effects.effect import Effect, EffectParameter, Values

MOST, USUAL = 0.8, 0.25  # relative change at the fastest speed: the largest, and its standard deviation


def apply(model: StabilityModel, values: Values) -> StabilityModel:
    """Change every stiffness by ``change_per_krpm`` (relative) for each 1000 rev/min, mass constant."""
    return replace(model, softening=model.softening + values["change_per_krpm"] / 1000.0)


def adapt(effect: Effect, problem: Any) -> Effect:
    """Keep the stiffness between a fifth and nine fifths of that at rest."""
    fastest = max(float(case.rpm.max()) for case in problem.cases) / 1000.0
    (parameter,) = effect.parameters
    bound = MOST / fastest
    fitted = replace(parameter, lower=-bound, upper=bound, plausible=USUAL / fastest)
    return replace(effect, parameters=(fitted,))


EFFECT = Effect(
    name="spindle_speed_softening",
    observables=("lobes",),
    parameters=(
        EffectParameter("change_per_krpm", "1", -0.5, 0.5, 0.01, starts=(-0.02, 0.02), plausible=0.1),
    ),
    apply=apply,
    signature=(
        "The lobes move along the speed axis, the more the faster the spindle, and the chatter frequency "
        "with them. At slow speed nothing changes."
    ),
    literature=(
        "Cao and Altintas, J. Mech. Des. 126 (2004) 1089; "
        "Gagnol et al., Int. J. Mach. Tools Manuf. 47 (2007) 1176"
    ),
    experiment=(
        "the chatter frequency at the slowest and at the fastest speed; an impact test on the turning spindle"
    ),
    adapt=adapt,
)
