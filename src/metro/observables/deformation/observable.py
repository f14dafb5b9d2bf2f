"""Force-induced deformation of machined walls: stylus profiles, load tests, and joints that give way."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.joint_columns import axes_of
from metro.observables.arm import tip_force
from metro.observables.arm.give import GivingArm, giving_arm
from metro.observables.arm.idle_runs import carried_weight, of_idle_logs
from metro.observables.arm.load_tests import best_compliance, calibration, lacking, largest_loads
from metro.observables.arm.no_arm import no_arm
from metro.observables.arm.tip_force import Log
from metro.observables.arm.wall import wall
from metro.observables.arm.wall_profile import WEIGHT, wall_points
from metro.observables.deformation import NAME, TABLES
from metro.observables.deformation.blocks import (
    SYSTEMATIC,
    WallErrors,
    believed_block,
    cutoff,
    wall_blocks,
    with_waves,
)
from metro.observables.deformation.model import DeformationModel
from metro.observables.deformation.proposals import feasible
from metro.observables.deformation.report import arm_block, tip_forces
from metro.observables.observable import Observable
from metro.observables.problem import BaseFit, Problem, Refusal
from metro.robot.kinematics import Arm, arm_of_cell
from metro.same import Same
from metro.units import JSON, MM, Array

SCATTER = 0.005  # of a joint from run to run: what scatters is the force, which each wall allows for


def observe(batch: Batch, read: Tables, identified: JSON) -> dict[str, pd.DataFrame] | Refusal:
    """Tip forces along the path, points along the walls, observability of the joints, and the load tests.

    Tables ``tip_force``, ``profile_points``, ``observability``, ``arm_loads``, ``deformation_refused``.
    """
    arm = giving_arm(batch, read)
    if isinstance(arm, Refusal):
        return arm
    by_table: dict[str, list[pd.DataFrame]] = {"tip_force": [], "profile_points": [], "observability": []}
    refused: list[JSON] = []
    for run in batch.with_files("robot_log", "profile", any_of=True):
        for name, table in _observed(batch, run, read, arm, identified).items():
            if isinstance(table, Refusal):
                refused.append({"run": run, "what": name.replace("_", " "), "reason": table.reason})
            else:
                by_table[name].append(table.assign(run=run))
    by_table["tip_force"] = [
        by_repeat(batch, force, by_table["tip_force"]) for force in by_table["tip_force"]
    ]
    tables = {name: pd.concat(parts, ignore_index=True) for name, parts in by_table.items() if parts}
    tables["arm_loads"] = arm.loads
    tables["deformation_refused"] = pd.DataFrame(refused, columns=["run", "what", "reason"], dtype=str)
    return tables


def _observed(
    batch: Batch, run: str, read: Tables, known: GivingArm, identified: JSON
) -> dict[str, pd.DataFrame | Refusal]:
    """Tables of one run, or why it has none."""
    face, arm = wall(batch, run), known.model.arm
    cut, idle = tip_force.logs(read("robot", run), arm)
    log = known.log(batch, run, cut, face)
    tables: dict[str, pd.DataFrame | Refusal] = {}
    sensorless, per_joint = tip_force.from_torques(cut, idle, arm, face)
    if per_joint is not None:
        tables["observability"] = per_joint
    if isinstance(sensorless, Refusal):
        tables["sensorless force for the deformation"] = sensorless
    force, source = tip_force.from_dynamometer(batch, run, read, face), "dynamometer"
    if isinstance(force, Refusal):
        force, source = sensorless, "torque"
    if isinstance(force, Refusal):
        give = partial(known.give, log, face)
        force, source = tip_force.from_coefficients(batch, run, identified, face, give), "coefficients"
    tables["tip_force"] = force if isinstance(force, Refusal) else force.assign(source=source)
    if run in batch.with_files("profile"):
        lost = len(cut.tip) and not cut.followed
        points = Refusal(tip_force.NO_SET_POINTS) if lost else _points(batch, run, read, log, arm)
        tables["profile_points"] = points
    return tables


def by_repeat(batch: Batch, force: pd.DataFrame, others: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Return the force that the dynamometer read in a repeat, where that is better than the run's own."""
    if SYSTEMATIC[str(force["source"].iloc[0])] <= SYSTEMATIC["repeat"]:
        return force
    run, condition = force["run"].iloc[0], batch.runs["condition"].to_dict()
    for other in others:
        alike = condition[other["run"].iloc[0]] == condition[run] and condition[run] != ""
        if alike and other["source"].iloc[0] == "dynamometer":
            return other.assign(run=run, source="repeat")
    return force


def _points(batch: Batch, run: str, read: Tables, log: Log | Refusal, arm: Arm) -> pd.DataFrame | Refusal:
    """Points along a wall, or why the trace cannot be placed on it."""
    if isinstance(log, Refusal):
        return log
    face, profile = wall(batch, run), read("profile", run)
    if not face.normal.any():
        return Refusal("direction is neither up nor down: which wall was traced is not known")
    weight = partial(carried_weight, of_idle_logs(Same(batch), Same(read)), arm.dh)
    return wall_points(profile, log, arm, face, cutoff=cutoff(batch), noise=_noise(batch), weight=weight)


def _noise(batch: Batch) -> float:
    return float(batch.instrument("profiler").get("sigma_mm", 0.0005)) * MM


def problem(batch: Batch, observed: Mapping[str, pd.DataFrame], _identified: JSON) -> Problem | Refusal:
    """Walls and load tests as blocks, and the model of the arm with elastic joints."""
    arm = arm_of_cell(batch.cell, batch.manifest)
    if arm is None:
        return Refusal(no_arm(batch.cell))
    model = DeformationModel(arm)
    softness = best_compliance(batch, model, observed["arm_loads"])
    beside = lacking(model, observed["arm_loads"])
    errors = WallErrors(partial(model.per_newton, compliance=softness), model.per_radian, beside.share)
    walls, notes = wall_blocks(batch, observed, errors)
    if not walls:
        return Refusal("; ".join(note.rstrip(".") for note in notes) or "no run has a profile")
    evidence = calibration(batch, model, observed["arm_loads"], beside)
    if isinstance(evidence, Refusal):
        return evidence
    calibrate, said = evidence
    sources = observed["tip_force"].drop_duplicates("run").set_index("run")["source"]
    used = sorted({str(sources[block.run]) for block in walls})
    notes = (
        "The joints are linear springs; links, tool and work are rigid.",
        f"The force on the tip is taken from: {', '.join(used)}.",
        f"Profiles and predictions are low-passed at {cutoff(batch) / MM:g} mm (ISO 16610-21); "
        "half of that is left out at both ends.",
        *said,
        *_of_weight(observed["profile_points"]),
        *notes,
    )
    forces = tuple(dict.fromkeys(block.setting.source for block in walls))
    base = replace(
        model,
        touched=True,
        forces=forces,
        springs=tuple(np.maximum(softness, 0.0).tolist()),
        loaded=tuple(largest_loads(model, observed["arm_loads"]).tolist()),
    )
    base, walls = with_waves(base, walls, _ratios(batch, model.arm))
    scatter = np.array([0.0 if one in base.believed else SCATTER for one in base.parameters])
    return Problem(
        NAME, "mm", MM, base, (believed_block(base), *calibrate, *walls), scatter,
        beside.share / math.sqrt(3.0), tuple(notes), feasible(walls, calibrate, model.arm, errors),
    )  # fmt: skip


def _of_weight(points: pd.DataFrame) -> list[str]:
    """Say so where the walls are predicted without what the weight of the arm does along them."""
    known = points[axes_of(points).driven(WEIGHT)].to_numpy().any()
    return (
        []
        if known
        else ["How the arm bends along a wall by its own weight is not known: no idle run shows it."]
    )


def _ratios(batch: Batch, arm: Arm) -> Array | None:
    """Return the turns of the motor per turn of each joint that turns; None where they are not declared."""
    declared = (batch.cell.get("drives") or {}).get("gear_ratio")
    return None if declared is None else np.asarray(declared, dtype=float)[arm.axes.turning]


def report(
    batch: Batch,
    observed: Mapping[str, pd.DataFrame],
    identified: JSON,
    task: Problem | Refusal,
    fit: BaseFit | None,
) -> JSON:
    """Return the ``arm`` block: joint stiffnesses, and what is known of each run."""
    return {"arm": arm_block(batch, observed, task, fit) | tip_forces(batch, observed, identified)}


OBSERVABLE = Observable(NAME, TABLES, observe, problem, report, observed_with_coefficients=True, retold=True)
