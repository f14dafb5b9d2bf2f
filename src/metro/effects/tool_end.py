"""Tool end: the tool has a ball end or a corner radius that batch.yaml does not declare."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from metro.effects.effect import Effect, EffectParameter, Values
from metro.observables.force.model import ForceModel
from metro.observables.problem import Problem, Refusal
from metro.units import MM

SHARES = (0.1, 0.4, 1.0)  # of the radius: a common corner, a bull nose, a ball
LEAST_RATIO = 1.2  # between depths of cut


def apply(model: ForceModel, values: Values) -> ForceModel:
    """Round the corner of the tool by ``corner_radius_mm`` more, at most to a ball."""
    corner = min(model.cutter.corner + values["corner_radius_mm"] * MM, model.cutter.radius)
    return replace(model, cutter=replace(model.cutter, corner=max(corner, 0.0)))


def adapt(effect: Effect, problem: Problem) -> Effect | Refusal:
    """Try every radius from a flat end to a ball, where the runs differ in depth.

    At one depth the corner mixes the radial with the axial force in one ratio, as coefficients do.
    """
    base: Any = problem.base
    if base.end_declared:
        return Refusal("")
    depths = [block.setting.cut.axial_depth for block in problem.role("identify")]
    if max(depths) < LEAST_RATIO * min(depths):
        return Refusal(
            "all runs were cut at nearly one depth, where the coefficients absorb the effect of a corner "
            "radius"
        )
    most = base.cutter.radius / MM
    (corner,) = effect.parameters
    starts = tuple(float(share * most) for share in SHARES)
    uniform = most / np.sqrt(3.0)  # deviation from zero of what is anything from a flat end to a ball
    fitted = replace(corner, upper=most, scale=0.05 * most, starts=starts, plausible=float(uniform))
    return replace(effect, parameters=(fitted,))


EFFECT = Effect(
    name="tool_end",
    observables=("force",),
    parameters=(
        EffectParameter("corner_radius_mm", "mm", 0.0, 100.0, 0.5, starts=(1.0, 5.0), nothing_above=True),
    ),
    apply=apply,
    belongs_to=("tool",),
    adapt=adapt,
    signature=(
        "Axial force that grows less than in proportion to the depth while the force in the plane does not: "
        "near the tip the chip presses the tool along its axis. A drift or an offset of the sensor has a "
        "similar signature in the means, but does not depend on the depth."
    ),
    literature=(
        "Lee and Altintas, Int. J. Mach. Tools Manuf. 36 (1996) 1059: ball ends; "
        "Engin and Altintas, Int. J. Mach. Tools Manuf. 41 (2001) 2195: general cutters"
    ),
    experiment=(
        "slots at three or more depths, the least below the corner radius; or the tool under a microscope"
    ),
    remedy="check the end of the tool, and enter tool.corner_radius_mm in batch.yaml",
)
