"""Waviness of machined walls: what the stylus finds between 0.8 and 8 mm, and how far the tip strayed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.joint_columns import numbered
from metro.observables.arm import tip_force
from metro.observables.arm.load_tests import best_compliance
from metro.observables.arm.no_arm import no_arm
from metro.observables.arm.wall import wall
from metro.observables.deformation.model import DeformationModel
from metro.observables.observable import Observable
from metro.observables.problem import BaseFit, Problem, Refusal
from metro.observables.waviness import NAME, TABLES
from metro.observables.waviness.blocks import believed_block, wave_block
from metro.observables.waviness.model import WavinessModel
from metro.observables.waviness.points import ENCODER, wave_points
from metro.observables.waviness.report import transfer, waviness_of
from metro.robot.kinematics import Arm, arm_of_cell
from metro.units import JSON, MM, UM, Array

SCATTER = 0.02
SYSTEMATIC = 0.01  # geometry of arm and tool, that all runs share

Read = Callable[..., pd.DataFrame]


def observe(batch: Batch, read: Read, _identified: JSON) -> dict[str, pd.DataFrame] | Refusal:
    """Points along the walls with how the tip strayed there, and what is to know of each run's.

    Tables ``waviness_points``, ``waviness_runs``, ``waviness_refused``.
    """
    arm = arm_of_cell(batch.cell, batch.manifest)
    if arm is None:
        return Refusal(no_arm(batch.cell))
    points, facts, refused = [], [], []
    for run in batch.with_files("profile"):
        face = wall(batch, run)
        cut, idle = tip_force.logs(read("robot", run), arm)
        result: Any = Refusal("no robot_log: how the tip strayed is not known")
        if not face.normal.any():
            result = Refusal("direction is neither up nor down: which wall was traced is not known")
        elif len(cut.tip) and not cut.followed:
            result = Refusal(tip_force.NO_SET_POINTS)
        elif len(cut.tip):
            result = wave_points(read("profile", run), cut, idle, arm, face, cutoff=_cutoff(batch))
        if isinstance(result, Refusal):
            refused.append({"run": run, "reason": result.reason})
        else:
            points.append(result[0].assign(run=run))
            facts.append({"run": run, **result[1]})
    if not points and not refused:
        return Refusal("no run has a profile")
    tables = {"waviness_refused": pd.DataFrame(refused, columns=["run", "reason"], dtype=str)}
    if points:
        tables["waviness_points"] = pd.concat(points, ignore_index=True)
        tables["waviness_runs"] = pd.DataFrame(facts)
    return tables


def _cutoff(batch: Batch) -> float:
    return float(batch.instrument("profiler").get("cutoff_mm", 8.0)) * MM


def problem(batch: Batch, observed: Mapping[str, pd.DataFrame], _identified: JSON) -> Problem | Refusal:
    """Walls as blocks, wave by wave, and the model of the straying tip."""
    arm = arm_of_cell(batch.cell, batch.manifest)
    if arm is None:
        return Refusal(no_arm(batch.cell))
    refused = observed["waviness_refused"].groupby("reason", sort=False)["run"]
    notes = [f"No waviness of {', '.join(runs)}: {reason}." for reason, runs in refused]
    if "waviness_points" not in observed:
        return Refusal(" ".join(notes))
    compliance = _compliance(batch, arm, observed)
    forces = dict(tuple(observed["tip_force"].groupby("run"))) if "tip_force" in observed else {}
    facts = observed["waviness_runs"].set_index("run")
    known: dict[str, JSON] = {str(run): dict(row) for run, row in facts.iterrows()}
    roles = {str(run): role for run, role in batch.runs["role"].items()}
    blocks = tuple(
        wave_block(
            batch,
            str(run),
            points,
            known[str(run)],
            force=forces.get(str(run)),
            arm=arm,
            compliance=compliance,
        )
        for run, points in observed["waviness_points"].groupby("run", sort=False)
        if roles[str(run)] in {"identify", "validate"}
    )
    if not blocks:
        return Refusal(" ".join(["no run with a profile has a role", *notes]))
    used = facts.loc[[block.run for block in blocks]]
    said = (
        "The wall follows the tip's tracking error by the encoders of the cut.",
        f"Profile and tracking error lie between {used['shortest_mm'].max():.2g} and "
        f"{_cutoff(batch) / MM:g} mm (ISO 16610-21); one cut-off is left out at both ends. Waves longer than "
        "the cut-off, and those as long as the feed marks, are not compared.",
        "The encoders' noise is "
        f"{np.sqrt((used[numbered(ENCODER, used)] ** 2).sum(axis=1)).median():.2g} µm at the tip, every "
        f"{used['log_step_mm'].median():.2g} mm: each wave of each joint counts by what of it may be more.",
        *_said_of_shifts(used),
        *_said_of_dust(used),
        *([] if compliance.any() else ["No joint compliance is known: torques twist no joint here."]),
        *([] if forces else ["No force on the tip is known: no joint passes a gap here."]),
        *notes,
    )
    base = WavinessModel(tuple(arm.axes.turning))
    return Problem(NAME, "um", UM, base, (believed_block(), *blocks), np.array([SCATTER]), SYSTEMATIC, said)


def _said_of_dust(facts: pd.DataFrame) -> list[str]:
    """Say of how many points of a profile dust was removed."""
    dusty = facts[facts["dust_points"] > 0]
    listed = ", ".join(f"{run} {points}" for run, points in dusty["dust_points"].items())
    return (
        [f"Points of the profiles that lie on narrow spikes (dust) are left out: {listed}."] if listed else []
    )


def _said_of_shifts(facts: pd.DataFrame) -> list[str]:
    """Say which profiles were put elsewhere along the log, and by how much."""
    moved = facts[facts["shifted"]]
    listed = ", ".join(
        f"{run} by {by:.2f} ± {1.96 * sd:.2f} mm"
        for run, by, sd in zip(moved.index, moved["shift_mm"], moved["shift_sd_mm"], strict=True)
    )
    return (
        [f"Profiles lie elsewhere along the log of the cut: {listed}; they were put back."] if listed else []
    )


def _compliance(batch: Batch, arm: Arm, observed: Mapping[str, pd.DataFrame]) -> Array:
    """Joint compliances (n,) before any cut: of the load tests, else of the cell file, else none."""
    return best_compliance(batch, DeformationModel(arm), observed.get("arm_loads", pd.DataFrame()))


def report(
    _batch: Batch,
    _observed: Mapping[str, pd.DataFrame],
    _identified: JSON,
    task: Problem | Refusal,
    fit: BaseFit | None,
) -> JSON:
    """Return the waviness of each run, measured and predicted by the fitted base model, and the transfer."""
    if isinstance(task, Refusal) or fit is None:
        reason = task.reason if isinstance(task, Refusal) else "no run to fit"
        return {"arm": {"not_identified": {"waviness": reason}}}
    by_run, beside = {}, []
    runs = [block for block in task.blocks if not block.belief]
    for block in runs:
        matrix, offset = task.base.design(block, np.zeros(0), fit.beta)
        by_run[block.run] = waviness_of(block, offset + matrix @ fit.beta)
        beside.append(offset)
    return {"arm": {"waviness": by_run, "waviness_transfer": transfer(runs, beside)}}


OBSERVABLE = Observable(NAME, TABLES, observe, problem, report, observed_with_coefficients=True)
