"""Entry transient: every pass begins too high at the edge of the block and settles over some distance.

Drives that droop under a sudden load, and come back by their integral action, do the opposite where the load
ends: the tip then is too low behind the last chip.
"""

from __future__ import annotations

from dataclasses import replace
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


def adapt(effect: Effect, problem: Problem) -> Effect | Refusal:
    """Look for lengths between the spacing of the compared points and half a pass."""
    settings: list[Any] = [block.setting for block in problem.role("identify")]
    if not all(np.isfinite(setting.pace.edge).all() for setting in settings):
        return Refusal("work.size_mm, which says where a pass enters the block, is not given")
    amplitude, length, leaving = effect.parameters
    whole = min(float(setting.passages.along[setting.passages.valid].max()) for setting in settings)
    longest = max(LONGEST * whole / MM, 2.0 * length.lower)
    starts = tuple(start for start in length.starts if start < longest)
    length = replace(length, upper=longest, starts=starts)
    seen = any(_leaves(setting) for setting in settings)
    return replace(effect, parameters=(amplitude, length, leaving) if seen else (amplitude, length))


def _leaves(setting: Any) -> bool:
    """Whether a rim goes over a compared point after the force has begun to fall."""
    after = setting.pace.outside(setting.passages) > -setting.pace.radius
    return bool((after & setting.passages.valid).any())


EFFECT = Effect(
    name="entry_transient",
    observables=("flatness",),
    parameters=(
        EffectParameter("amplitude_um", "um", -1000.0, 1000.0, 1.0, starts=(-10.0, 10.0)),
        EffectParameter("length_mm", "mm", 2.0, 500.0, 2.0, starts=(5.0, 15.0, 40.0)),
        EffectParameter("exit_um", "um", -1000.0, 1000.0, 1.0, starts=(0.0,), optional=True),
    ),
    apply=apply,
    part="setup",
    adapt=adapt,
    signature=(
        "The same decay behind the entry of every pass, whatever the depth of cut and the pose, and often "
        "the opposite where the cutter leaves the block. The ringing of the arm's modes is at the same "
        "place, but swings, and goes with the force."
    ),
    literature="Altintas et al., CIRP Ann. 60 (2011) 779: feed drives under load",
    experiment="the same pass at two feeds and at two depths: a drive that droops does so with the force",
    remedy="begin each pass further outside the block, or lower the feed where the tool enters",
)
