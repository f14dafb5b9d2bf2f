"""Speed softening: the stiffness of the spindle at speed differs from that of the hammer test at rest."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from metro.dynamics.softening import Softening
from metro.dynamics.stability_model import StabilityModel
from metro.dynamics.system import Structure
from metro.effects.effect import Effect, EffectParameter, Values

MOST, USUAL = 0.8, 0.25  # relative change at the fastest speed: the largest, and its standard deviation
# What of the flexibility 1 / (2 k ζ) of the most flexible mode another must have for its share to be sought:
# a mode with less bounds the depth at lobes' peaks alone.
FLEXIBLE = 0.2
UNSOUGHT = 0.5  # share of the others: the mean of what it may be


def apply(model: StabilityModel, values: Values) -> StabilityModel:
    """Change stiffnesses by ``change_per_krpm`` (relative) for each 1000 rev/min up to the speed ``at_krpm``.

    At others it goes with a power of the speed, ``exponent``; mass is constant. That is the mean over the
    modes, weighed by their compliance. What each of them has of it is in proportion to its ``share``; without
    shares, and where a mode is added to these, every stiffness changes as the mean does.
    """
    change, at = values["change_per_krpm"] * values.get("at_krpm", 1.0), values.get("at_krpm", 1.0) * 1000.0
    exponent = values.get("exponent", 1.0)
    shares = np.atleast_1d(values.get("share", ()))[: len(model.structure.stiffness)]
    if len(shares) < 2:
        softening = Softening(change, at, exponent)
    else:
        mean = max(float(np.average(shares, weights=1.0 / model.structure.stiffness[: len(shares)])), 1e-3)
        softening = Softening(change / mean, at, exponent, tuple(shares.tolist()), mean)
    return replace(model, softening=(*model.softening, softening))


def adapt(effect: Effect, problem: Any) -> Effect:
    """Keep the stiffness between a fifth and nine fifths of that at rest, and seek the shares of modes.

    The speed up to which the change is given is the mean of those tested.
    """
    tested = np.concatenate([case.rpm for case in problem.cases]) / 1000.0
    by_name = {parameter.name: parameter for parameter in effect.parameters}
    bound, at = MOST / float(tested.max()), float(tested.mean())
    change = replace(
        by_name["change_per_krpm"], lower=-bound, upper=bound, plausible=USUAL / float(tested.max())
    )
    there = replace(by_name["at_krpm"], lower=at, upper=at)
    shares = _shares(by_name["share"], [case.model.structure for case in problem.cases])
    return replace(effect, parameters=(change, there, by_name["exponent"], *shares))


def _shares(share: EffectParameter, structures: list[Structure]) -> list[EffectParameter]:
    """Return a share of each mode, to be sought where the mode is flexible; none where places differ."""
    first = structures[0]
    if len(first.omega) < 2 or any(not _same(first, one) for one in structures[1:]):
        return []
    flexibility = 1.0 / (first.stiffness * first.zeta)
    sought = flexibility >= FLEXIBLE * flexibility.max()
    return [share if one else replace(share, lower=UNSOUGHT, upper=UNSOUGHT) for one in sought]


def _same(one: Structure, other: Structure) -> bool:
    return np.array_equal(one.omega, other.omega) and np.array_equal(one.stiffness, other.stiffness)


EFFECT = Effect(
    name="spindle_speed_softening",
    observables=("lobes",),
    parameters=(
        EffectParameter("change_per_krpm", "1", -0.5, 0.5, 0.01, starts=(-0.02, 0.02), plausible=0.1),
        EffectParameter("at_krpm", "1", 0.1, 100.0, 1.0, starts=(1.0,), neutral=1.0, optional=True),
        EffectParameter("exponent", "1", 1.0, 2.0, 0.3, starts=(1.0, 2.0), neutral=1.0, optional=True),
        EffectParameter("share", "1", 0.0, 1.0, 0.3, starts=(1.0,), neutral=1.0, optional=True),
    ),
    apply=apply,
    signature=(
        "The lobes move along the speed axis, the more the faster the spindle, and the chatter frequency "
        "with them. At slow speed nothing changes, and nothing does where a mode of the work chatters."
    ),
    literature=(
        "Cao and Altintas, J. Mech. Des. 126 (2004) 1089; "
        "Gagnol et al., Int. J. Mach. Tools Manuf. 47 (2007) 1176; "
        "Abele, Altintas and Brecher, CIRP Ann. 59 (2010) 781"
    ),
    experiment=(
        "the chatter frequency at the slowest and at the fastest speed; an impact test on the turning spindle"
    ),
    remedy="measure the receptance at speed, on the turning spindle, and predict stability with it",
    adapt=adapt,
)
