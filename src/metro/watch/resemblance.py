"""What a run that differs from its prediction looks like: one linear step of each of a handful of causes.

Each cause says in which directions it moves the prediction. The step along these that explains most of the
residual is found by least squares, weighted by the noise; the phase at which the record starts is fitted
beside it. One run can show which shape its residual has. It cannot distinguish causes of the same shape: the
depth, the feed and the work all scale the force.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from metro.cutting.engagement import with_wall_proud
from metro.effects import dynamometer_rotation, tool_runout
from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.system import sensitivities
from metro.observables.force.model import ForceModel
from metro.observables.problem import Block, predictions
from metro.units import MM, Array
from metro.watch.figures import Compared

EXPLAINS = 0.75  # of what the weighted square of the residual has beyond noise, for a cause to be named
ALIKE = 0.06  # of it, by which a cause may explain less than the best one and still be named beside it
STEP_UM, STEP_DEG, STEP_MM = 1.0, 0.5, 0.02


@dataclass(frozen=True)
class Likeness:
    """A cause that a residual looks like.

    Attributes
    ----------
    code : its name. explained : share of what the weighted square of the residual has beyond noise.
    size : of the cause, in the units of its directions.
    """

    code: str
    explained: float
    size: tuple[float, ...]


# Largest size at which a cause is still one: beyond, something else is taken for it.
LARGEST = {
    "proportion": 0.9,
    "feed": 0.9,
    "edge": 6.0,
    "thrust": 3.0,
    "runout": 100.0,
    "turned": 20.0,
    "radial": 3.0,
}


def likenesses(compared: Compared) -> tuple[Likeness, ...]:
    """Return the causes whose shape the residual has, the best one first; none where no cause explains it."""
    block = compared.block
    alone = compared.scored.noise.alone(block)
    weight = 1.0 / np.sqrt(noise_room.diagonal(block, alone))
    causes, own = _causes(compared)
    basis = np.linalg.qr(own * weight[:, None])[0]

    def beside_phase(values: Array) -> Array:
        return np.asarray(values - basis @ (basis.T @ values))

    left = beside_phase(compared.residual * weight)
    total = float(left @ left)
    noise = total / max(compared.whole.ratio, compared.worst.ratio) ** 2
    found = []
    for code, directions in causes.items():
        moved = beside_phase(directions * weight[:, None])
        moving = np.linalg.norm(moved, axis=0) > 0.0
        if not moving.any():
            continue
        size = np.zeros(directions.shape[1])
        size[moving] = np.linalg.lstsq(moved[:, moving], left, rcond=1e-9)[0]
        explained = min(1.0, (total - float(np.sum((left - moved @ size) ** 2))) / (total - noise))
        if float(np.linalg.norm(size)) <= LARGEST.get(code, np.inf):
            found.append(Likeness(code, explained, tuple(size.tolist())))
    best = max((each.explained for each in found), default=0.0)
    if best < EXPLAINS:
        return ()
    named = [each for each in found if each.explained >= best - ALIKE]
    return tuple(sorted(named, key=lambda each: -each.explained))


def _causes(compared: Compared) -> tuple[Mapping[str, Array], Array]:
    """Return the directions (n, k) of each cause, and those of the run's own unknowns."""
    scored, block = compared.scored, compared.block
    model = cast("ForceModel", scored.candidate.model(scored.theta))
    nuisance, beta = scored.nuisance[block.run], scored.beta
    matrix, _ = model.design(block, nuisance, beta)
    radial = np.array([parameter.name in ("krc", "kre") for parameter in model.parameters])
    shear = np.array([parameter.name.endswith("c") for parameter in model.parameters])
    each = len(block.measured) // block.repeats
    since = np.repeat(block.slow["along the run"][:, 0], each)
    here = predictions(model, block, nuisance[None], beta)[0]

    def moved(others: Sequence[tuple[ForceModel, Block]], step: float) -> Array:
        rows = [predictions(other, its, nuisance[None], beta)[0] - here for other, its in others]
        return np.array(rows).T / step

    runout: list[Any] = [{"radius_um": STEP_UM, "angle_deg": angle} for angle in (0.0, 90.0)]
    causes = {
        "proportion": (matrix @ beta)[:, None],
        "feed": (matrix[:, shear] @ beta[shear])[:, None],
        "edge": (matrix[:, ~shear] @ beta[~shear])[:, None],
        "thrust": (matrix[:, radial] @ beta[radial])[:, None],
        "runout": moved([(tool_runout.apply(model, each), block) for each in runout], STEP_UM),
        "turned": moved([(dynamometer_rotation.apply(model, {"angle_deg": STEP_DEG}), block)], STEP_DEG),
        "zero": block.zeros,
        "drift": block.zeros * since[:, None],
    }
    if thinner := _thinner(model, block):
        causes["radial"] = moved([(model, thinner)], -STEP_MM)
    return causes, sensitivities(model, [], block, nuisance, beta)[1]


def _thinner(model: ForceModel, block: Block) -> Block | None:
    """Return a side cut of a radial depth that is smaller by a step; None where there is no single wall."""
    arc = block.setting.cut.engagement
    ends = [math.isclose(arc.entry, 0.0, abs_tol=1e-9), math.isclose(arc.exit, math.pi, abs_tol=1e-9)]
    if sum(ends) != 1:
        return None
    arc = with_wall_proud(arc, model.cutter.radius, STEP_MM * MM)
    return replace(block, setting=replace(block.setting, cut=replace(block.setting.cut, engagement=arc)))
