"""Entry transient: every pass begins too high or too low at the edge of the block, and then settles.

Drives that droop under a sudden load, and come back by their integral action, do the opposite where the load
ends: the tip then is too low behind the last chip. What makes a transient is not always the load (an axis
that speeds up, a tip that warms up), so one form has the same heights in every face, whatever its force.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.flatness.model import FlatnessModel
from metro.observables.problem import Problem, Refusal
from metro.units import MM, UM

LONGEST = 0.5  # of the shortest pass: what fades more slowly is a tilt


def apply(model: FlatnessModel, values: Values) -> FlatnessModel:
    """Lift the tip by ``amplitude_um`` as the axis comes to the block's edge; fades over ``length_mm``.

    ``exit_um`` is the lift by the end of the force, where the cutter leaves the block.
    """
    heights = values["amplitude_um"] * UM, values.get("exit_um", 0.0) * UM
    transient = (heights[0], values["length_mm"] * MM, heights[1])
    return replace(model, setup=replace(model.setup, entry=(*model.setup.entry, transient)))


def droop(model: FlatnessModel, values: Values, force: float = 1.0) -> FlatnessModel:
    """Let the tip give way as the force rises and come back over ``length_mm``; as it falls, the opposite.

    ``amplitude_um`` is by how much it has, under a ``force``, N, when the axis comes to the block's edge.
    """
    given = (values["amplitude_um"] * UM / force, values["length_mm"] * MM)
    return replace(model, setup=replace(model.setup, droops=(*model.setup.droops, given)))


def adapt_droop(effect: Effect, problem: Problem) -> Effect | Refusal:
    """Count the force from the mean of the identification runs; lengths as of :func:`adapt`."""
    adapted = adapt(effect, problem)
    if isinstance(adapted, Refusal):
        return adapted
    settings: list[Any] = [block.setting for block in problem.role("identify")]
    usual = float(np.mean([np.linalg.norm(setting.force) for setting in settings]))
    if not usual > 0.0:
        return Refusal("no force on the tool is known")
    return replace(adapted, apply=partial(droop, force=usual))


def adapt(effect: Effect, problem: Problem) -> Effect | Refusal:
    """Look for lengths between the spacing of the compared points and half a pass."""
    settings: list[Any] = [block.setting for block in problem.role("identify")]
    if not all(np.isfinite(setting.pace.edge).all() for setting in settings):
        return Refusal("work.size_mm, which says where a pass enters the block, is not given")
    amplitude, length, *leaving = effect.parameters
    whole = min(float(setting.passages.along[setting.passages.valid].max()) for setting in settings)
    longest = max(LONGEST * whole / MM, 2.0 * length.lower)
    starts = tuple(start for start in length.starts if start < longest)
    length = replace(length, upper=longest, starts=starts)
    seen = any(_leaves(setting) for setting in settings)
    return replace(effect, parameters=(amplitude, length, *(leaving if seen else ())))


def _leaves(setting: Any) -> bool:
    """Whether a rim goes over a compared point after the force has begun to fall."""
    after = setting.pace.outside(setting.passages) > -setting.pace.radius
    return bool((after & setting.passages.valid).any())


AMPLITUDE = EffectParameter("amplitude_um", "um", -1000.0, 1000.0, 1.0, starts=(-10.0, 10.0))
LENGTH = EffectParameter("length_mm", "mm", 2.0, 500.0, 2.0, starts=(5.0, 15.0, 40.0))
LEAVING = EffectParameter("exit_um", "um", -1000.0, 1000.0, 1.0, starts=(0.0,), optional=True)

OF_ANY_FORCE = Effect(
    name="entry_transient",
    observables=("flatness",),
    parameters=(AMPLITUDE, LENGTH, LEAVING),
    apply=apply,
    part="setup",
    adapt=adapt,
    prior=0.5,
    signature=(
        "The same decay behind the entry of every pass, whatever the depth of cut and the pose, and often "
        "the opposite where the cutter leaves the block. The ringing of the arm's modes is at the same "
        "place, but swings, and goes with the force."
    ),
    literature="Altintas et al., CIRP Ann. 60 (2011) 779: feed drives under load",
    experiment="the same pass at two feeds and at two depths: a drive that droops does so with the force",
    remedy="begin each pass further outside the block, or lower the feed where the tool enters",
)
OF_FORCE = replace(
    OF_ANY_FORCE,
    parameters=(AMPLITUDE, LENGTH),
    apply=droop,
    adapt=adapt_droop,
    form="with the force",
    where={"grows_with": "force"},
    signature=(
        "A decay behind the entry of every pass, in proportion to the force, and its opposite behind the "
        "last chip, as force comes and goes while the cutter enters and leaves. The ringing of the arm's "
        "modes goes with the force too, but swings."
    ),
    remedy="lower the feed where the tool enters, or let the drives' integral action be set faster",
)
EFFECT = (OF_ANY_FORCE, OF_FORCE)
