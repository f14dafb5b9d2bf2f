"""Walls as blocks: the deformation of one run from its trace, and the errors that it has alone or shares."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.joint_columns import Axes, axes_of
from metro.observables.arm import tip_force
from metro.observables.arm.tip_force import FORCE
from metro.observables.arm.wall import wall
from metro.observables.arm.wall_profile import SPACING, WEIGHT
from metro.observables.cut.conditions import feed
from metro.observables.deformation.gear_waves import Path, principal_waves
from metro.observables.deformation.model import (
    AXES,
    GEAR_WAVE,
    LOST_MOTION,
    STRAIGHT,
    WALL_ZERO,
    DeformationModel,
)
from metro.observables.deformation.setting import CutWall, KnownParameters
from metro.observables.problem import Block
from metro.units import ARCSEC, MM, UM, Array

AS_REPEATS = 0.02  # relative, how well the forces of repeats agree
# Relative error of the force of a run by its source; all runs share it, but for that between repeats.
SYSTEMATIC = {**tip_force.SYSTEMATIC, "repeat": math.hypot(tip_force.SYSTEMATIC["dynamometer"], AS_REPEATS)}
LOADED = 0.01  # load cell and gauge of the load tests, which all walls share
# Of a joint's compliance at the twist of a cut about that at the twist of the load tests: up to an eighth of
# the rated torque a gear is 10 to 35 % softer (makers), of which its share of the joint's twist leaves 10 %,
# and load tests that go beyond differ from a cut by about half of that.
SOFTER = 0.05
# Of a joint's twist under its largest load: the lost motion, and what is softer below a tenth of the rated
# torque. By the same figures it is 1 to 8 %.
TWISTED = 0.04
# Share of a joint's compliance that stays straight where its gear hardens, and how far it may be off: links
# and base make 20 to 50 % of the compliance of an arm (Klimchik et al. 2015, Abele et al. 2007), and half of
# that of its joints at small torques, where a gear that hardens is softer.
LINKS, OF_LINKS = 0.2, 0.1
TOUCHED = 10 * UM  # of the zero that all walls share: the touch on the work, and the tool's radius
ZERO = 5 * UM  # standard error of a profile's zero against the programmed wall, before repeats show theirs
DECLARED = 4  # walls for which that counts
# Where gears come to rest, by joint: half of a lost motion of 2 arcsec (makers: 0.4 to 60), the same in cuts
# alike, so that repeats do not show it; and the waves that they leave along one wall and not along others,
# as what changes its sign with the direction of the joint: about a tenth of all (:mod:`.gear_waves`).
LOST = 1.0 * ARCSEC
WAVES = 0.5 * ARCSEC
HALF_WAVES = 4  # along a wall, the longer the higher


@dataclass(frozen=True)
class WallErrors:
    """What an error of the force does to a wall of one arm.

    Attributes
    ----------
    per_newton, per_radian : see :class:`metro.observables.deformation.model.DeformationModel`.
    lack_of_fit : relative rms, over all directions of force (:mod:`metro.observables.arm.lack_of_fit`).
    """

    per_newton: Callable[[CutWall], Array]
    per_radian: Callable[[CutWall], Array]
    lack_of_fit: float

    def harder(self, setting: CutWall) -> Array:
        """Return what a wall gains, (n, 3) m, if the force is wrong along x, y or z by its whole size."""
        return float(np.linalg.norm(setting.force, axis=1).max()) * self.per_newton(setting)

    def own(self, setting: CutWall, relative: float = 0.0) -> Array:
        """Return the errors of a wall in which it is alone, (n, 8) m, for one of its force that it alone has.

        The arm gives way in each direction by another share than its joints say, which is an error as that of
        a force in that direction. Beside it are those of the gears.
        """
        of_force = math.hypot(relative, self.lack_of_fit / math.sqrt(3.0)) * self.harder(setting)
        return np.hstack([of_force, self._gears(setting)])

    def _gears(self, setting: CutWall) -> Array:
        """Return what gears leave on a wall whatever the force, (n, 5) m: a level, and waves along it."""
        place, number = setting.kept - setting.kept[0], np.arange(1, HALF_WAVES + 1)
        waves = np.cos(math.pi * place[:, None] / max(int(place[-1]), 1) * number) / number
        waves *= WAVES / math.sqrt(float((waves**2).mean(axis=0).sum()))
        level = np.full((len(place), 1), LOST)
        return np.hstack([level, waves]) * self.per_radian(setting)[:, None]


def cutoff(batch: Batch) -> float:
    """Wavelength between deformation and waviness, m."""
    return float(batch.instrument("profiler").get("cutoff_mm", 8.0)) * MM


def wall_blocks(
    batch: Batch, observed: Mapping[str, pd.DataFrame], errors: WallErrors
) -> tuple[list[Block], tuple[str, ...]]:
    """Return a block per wall that was traced, and sentences on the runs that have none.

    ``errors``: of a wall that those of its force make.
    """
    refused = observed["deformation_refused"].groupby(["what", "reason"], sort=False)["run"]
    notes = [f"No {what} of {', '.join(runs)}: {reason}." for (what, reason), runs in refused]
    blocks: list[Block] = []
    forces = dict(tuple(observed["tip_force"].groupby("run"))) if "tip_force" in observed else {}
    points = observed.get("profile_points", pd.DataFrame({"run": []}))
    for name, table in points.groupby("run", sort=False):
        run = str(name)
        if run in forces and batch.runs.loc[run, "role"] in {"identify", "validate"}:
            block = _wall_block(batch, run, table, forces[run], errors)
            if block is None:
                notes.append(f"Run {run}: the wall is too short for the filter.")
            else:
                blocks.append(block)
    return with_zeros(blocks), tuple(notes)


def with_zeros(blocks: Sequence[Block]) -> list[Block]:
    """Put the error of each wall as a whole among what is not identified, as large as repeats show it.

    Walls cut alike differ by the zero of the trace, and by what brings the joints to rest elsewhere. Only
    those that identify are compared.
    """
    groups: dict[str, list[float]] = {}
    for block in blocks:
        if block.role == "identify":
            groups.setdefault(block.condition, []).append(float(block.measured.mean()))
    square = sum(len(means) * float(np.var(means)) for means in groups.values())
    repeats = sum(len(means) - 1 for means in groups.values())
    zero = math.sqrt((DECLARED * ZERO**2 + square) / (DECLARED + repeats))
    return [_beside(block, np.full((len(block.measured), 1), zero)) for block in blocks]


def _beside(block: Block, zero: Array) -> Block:
    known = [] if block.unidentified is None else [block.unidentified]
    return replace(block, unidentified=np.hstack([zero, *known]))


def _wall_block(
    batch: Batch,
    run: str,
    points: pd.DataFrame,
    force: pd.DataFrame,
    errors: WallErrors,
) -> Block | None:
    """Wall points away from the filter's and the wall's ends; half a cut-off apart their noise is white.

    The zero of the trace is not estimated from the residual, because a displaced wall is no wrong zero.
    """
    face, longest = wall(batch, run), cutoff(batch)
    row: Any = batch.runs.loc[run]
    x = points["x_mm"].to_numpy() * MM
    last = min(face.length - face.leaving, float(x[-1])) - longest / 2
    kept = np.flatnonzero((x >= x[0] + longest / 2 - 1e-9) & (x <= last + 1e-9))[
        :: max(round(longest / 2 / SPACING), 1)
    ]
    if len(kept) < 2:
        return None
    along = force.sort_values("x_mm")
    at_points = np.stack([np.interp(x / MM, along["x_mm"], along[name]) for name in FORCE], axis=1)
    axes = axes_of(points)
    commanded, actual = (points[names].to_numpy() * axes.units for names in (axes.commanded, axes.positions))
    count = len(kept)
    # Without a feed in the run table the rate is zero, and no effect that depends on it is predicted.
    rate = np.gradient(commanded, SPACING, axis=0) * np.nan_to_num(feed(batch, run))
    read = str(force["source"].iloc[0])
    own, source = (AS_REPEATS, "dynamometer") if read == "repeat" else (0.0, read)
    setting = CutWall(commanded, actual, rate, at_points, face.normal, SPACING, longest, kept, source)
    setting = replace(setting, harder=errors.harder(setting), weight=_weight(points, axes))
    return Block(
        run=run,
        condition=str(row["condition"]),
        role="validate" if row["role"] == "validate" else "identify",
        order=int(row["order"]),
        measured=points["deformation_mm"].to_numpy()[kept] * MM,
        sigma=points["sigma_mm"].to_numpy()[kept] * MM,
        setting=setting,
        axis=np.full(count, "z"),
        zeros=np.zeros((count, 0)),
        zero_sd=np.zeros(0),
        unidentified=errors.own(setting, own),
        coordinates={"axis": np.full(count, "z"), "s_mm": x[kept] / MM, "x_mm": x[kept] / MM},
    )


def _weight(points: pd.DataFrame, axes: Axes) -> Array:
    """Torque of the arm's weight less that in mid-wall, (m, n) N m; zero on axes that do not turn."""
    torque = np.zeros((len(points), len(axes)))
    torque[:, axes.turning] = points[axes.driven(WEIGHT)].to_numpy()
    return np.asarray(torque - torque[len(torque) // 2])


def with_waves(
    model: DeformationModel, walls: Sequence[Block], ratios: Array | None
) -> tuple[DeformationModel, list[Block]]:
    """Return the model and the walls with the waves that the gears leave on all of them."""
    turning, settings = model.arm.axes.turning, [wall.setting for wall in walls]
    paths = [
        Path(*(one.commanded[:, turning], model.outwards(one)[:, turning], one.kept, one.spacing, one.cutoff))
        for one in settings
    ]
    waves = principal_waves(paths, ratios)
    shared = [
        replace(wall, setting=replace(wall.setting, waves=heights))
        for wall, heights in zip(walls, waves, strict=True)
    ]
    return replace(model, waves=waves[0].shape[1]), shared


def believed_block(model: DeformationModel) -> Block:
    """Return what is believed beforehand of the joints in the cut, the walls' zero, the force and the gears.

    A load cell that reads wrong makes all joints stiffer or softer, which is the same as a wrong force on the
    walls.
    """
    off = {source: math.hypot(SYSTEMATIC[source], LOADED) for source in model.forces}
    force = {f"force_off_{source}_{axis}": off[source] for source in model.forces for axis in AXES}
    lost = {f"{LOST_MOTION}{joint + 1}": TWISTED for joint in range(len(model.loaded))}
    waves = {f"{GEAR_WAVE}{wave + 1}": 1.0 for wave in range(model.waves)}
    straight = {f"{STRAIGHT}{joint + 1}": LINKS for joint in range(len(model.springs))}
    known = force | lost | waves | dict.fromkeys(straight, OF_LINKS) | {WALL_ZERO: TOUCHED}
    sigma = [known.get(one.name, SOFTER) for one in model.believed]
    count, value = len(sigma), np.array([straight.get(one.name, 0.0) for one in model.believed])
    places = len(model.parameters) - count + np.arange(count)
    names, zeros, none = np.array([one.name for one in model.believed]), np.zeros((count, 0)), np.zeros(0)
    return Block(
        *("believed", "believed", "calibrate", 0, value, np.array(sigma)),
        *(KnownParameters(places), names, zeros, none, {}),
        belief=True,
    )
