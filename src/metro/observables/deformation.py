"""Force-induced deformation of machined walls: stylus profiles, load tests, and joints that give way."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.observables import tip_force
from metro.observables.arm_give import GivingArm, giving_arm
from metro.observables.deformation_model import CutWall, DeformationModel
from metro.observables.load_tests import calibration, fitted_loads
from metro.observables.problem import BaseFit, Block, Problem, Refusal
from metro.observables.quantity import quantity
from metro.observables.tip_force import ACTUAL, FORCE, SET, SYSTEMATIC, Log
from metro.observables.wall import Wall, wall
from metro.observables.wall_profile import SPACING, wall_points
from metro.robot.kinematics import Arm, arm_of_cell
from metro.units import DEG, JSON, MM, UM

OBSERVABLE = "deformation"
SCATTER = 0.02
ZERO = 5 * UM  # how well a profile's zero is the programmed wall

Read = Callable[..., pd.DataFrame]


def observe(batch: Batch, read: Read, identified: JSON) -> dict[str, pd.DataFrame] | Refusal:
    """Tip forces along the path, points along the walls, observability of the joints, and the load tests.

    Tables ``tip_force``, ``profile_points``, ``observability``, ``arm_loads``, ``deformation_refused``.
    """
    arm = giving_arm(batch, read)
    if isinstance(arm, Refusal):
        return arm
    found: dict[str, list[pd.DataFrame]] = {"tip_force": [], "profile_points": [], "observability": []}
    refused: list[JSON] = []
    for run in _runs(batch, "robot_log", "profile"):
        for name, table in _observed(batch, run, read, arm, identified).items():
            if isinstance(table, Refusal):
                refused.append({"run": run, "what": name.replace("_", " "), "reason": table.reason})
            else:
                found[name].append(table.assign(run=run))
    tables = {name: pd.concat(parts, ignore_index=True) for name, parts in found.items() if parts}
    tables["arm_loads"] = arm.loads
    tables["deformation_refused"] = pd.DataFrame(refused, columns=["run", "what", "reason"], dtype=str)
    return tables


def _observed(
    batch: Batch, run: str, read: Read, known: GivingArm, identified: JSON
) -> dict[str, pd.DataFrame | Refusal]:
    """Tables of one run, or why it has none."""
    face, arm = wall(batch, run), known.model.arm
    cut, idle = tip_force.logs(read("robot", run), arm)
    log = known.log(batch, run, cut, face)
    tables: dict[str, pd.DataFrame | Refusal] = {}
    (force, per_joint), source = tip_force.from_torques(cut, idle, arm, face), "torque"
    if per_joint is not None:
        tables["observability"] = per_joint
    if isinstance(force, Refusal):
        tables["sensorless force"] = force
        force, source = tip_force.from_dynamometer(batch, run, read("force", run), face), "dynamometer"
    if isinstance(force, Refusal):
        give = partial(known.give, log, face)
        force, source = tip_force.from_coefficients(batch, run, identified, face, give), "coefficients"
    tables["tip_force"] = force if isinstance(force, Refusal) else force.assign(source=source)
    if run in _runs(batch, "profile"):
        tables["profile_points"] = _points(batch, read("profile", run), log, face, arm)
    return tables


def _points(
    batch: Batch, profile: pd.DataFrame, log: Log | Refusal, face: Wall, arm: Arm
) -> pd.DataFrame | Refusal:
    """Points along a wall, or why the trace cannot be placed on it."""
    if isinstance(log, Refusal):
        return log
    if not face.normal.any():
        return Refusal("direction is neither up nor down: which wall was traced is not known")
    return wall_points(profile, log, arm, face, cutoff=_cutoff(batch), noise=_noise(batch))


def _runs(batch: Batch, *columns: str) -> list[str]:
    """List the runs that have a file in one of ``columns``, in the order of cutting."""
    table = batch.runs.sort_values("order", kind="stable")
    named = table[list(columns)].apply(
        lambda column: column.map(lambda file: isinstance(file, str) and file != "")
    )
    return [str(run) for run in table.index[named.any(axis=1).to_numpy(dtype=bool)]]


def _cutoff(batch: Batch) -> float:
    return float(batch.instrument("profiler").get("cutoff_mm", 8.0)) * MM


def _noise(batch: Batch) -> float:
    return float(batch.instrument("profiler").get("sigma_mm", 0.0005)) * MM


def problem(batch: Batch, observed: Mapping[str, pd.DataFrame], _identified: JSON) -> Problem | Refusal:
    """Walls and load tests as blocks, and the model of the arm with elastic joints."""
    arm = arm_of_cell(batch.cell, batch.manifest)
    if arm is None:
        return Refusal(f"cell {batch.cell.get('cell')}: no arm.dh, nothing is known of the arm")
    walls, notes = _wall_blocks(batch, observed)
    if not walls:
        return Refusal("; ".join(notes) or "no run has a profile")
    model = DeformationModel(arm)
    evidence = calibration(batch, model, observed["arm_loads"])
    if isinstance(evidence, Refusal):
        return evidence
    calibrate, said = evidence
    sources = observed["tip_force"].drop_duplicates("run").set_index("run")["source"]
    used = sorted({str(sources[block.run]) for block in walls})
    notes = (
        "The joints are linear springs; links, tool and work are rigid.",
        f"The force on the tip is taken from: {', '.join(used)}.",
        f"Profiles and predictions are low-passed at {_cutoff(batch) / MM:g} mm (ISO 16610-21); "
        "half of that is left out at both ends.",
        *said,
        *notes,
    )
    systematic = max(SYSTEMATIC[source] for source in used)
    scatter = np.full(len(model.parameters), SCATTER)
    return Problem(OBSERVABLE, "mm", MM, model, (*calibrate, *walls), scatter, systematic, tuple(notes))


def _wall_blocks(batch: Batch, observed: Mapping[str, pd.DataFrame]) -> tuple[list[Block], tuple[str, ...]]:
    refused = observed["deformation_refused"].groupby(["what", "reason"], sort=False)["run"]
    notes = [f"No {what} of {', '.join(runs)}: {reason}." for (what, reason), runs in refused]
    blocks: list[Block] = []
    forces = dict(tuple(observed["tip_force"].groupby("run"))) if "tip_force" in observed else {}
    points = observed.get("profile_points", pd.DataFrame({"run": []}))
    for name, table in points.groupby("run", sort=False):
        run = str(name)
        if run in forces and batch.runs.loc[run, "role"] in {"identify", "validate"}:
            block = _wall_block(batch, run, table, forces[run])
            if block is None:
                notes.append(f"Run {run}: the wall is too short for the filter.")
            else:
                blocks.append(block)
    return blocks, tuple(notes)


def _wall_block(batch: Batch, run: str, points: pd.DataFrame, force: pd.DataFrame) -> Block | None:
    """Wall points away from the filter's and the wall's ends; half a cut-off apart their noise is white."""
    face, cutoff = wall(batch, run), _cutoff(batch)
    row: Any = batch.runs.loc[run]
    x = points["x_mm"].to_numpy() * MM
    last = min(face.length - face.leaving, float(x[-1])) - cutoff / 2
    kept = np.flatnonzero((x >= x[0] + cutoff / 2 - 1e-9) & (x <= last + 1e-9))[
        :: max(round(cutoff / 2 / SPACING), 1)
    ]
    if len(kept) < 2:
        return None
    along = force.sort_values("x_mm")
    at_points = np.stack([np.interp(x / MM, along["x_mm"], along[name]) for name in FORCE], axis=1)
    commanded, actual = points[SET].to_numpy() * DEG, points[ACTUAL].to_numpy() * DEG
    count = len(kept)
    return Block(
        run=run,
        condition=str(row["condition"]),
        role="validate" if row["role"] == "validate" else "identify",
        order=int(row["order"]),
        measured=points["deformation_mm"].to_numpy()[kept] * MM,
        sigma=points["sigma_mm"].to_numpy()[kept] * MM,
        setting=CutWall(commanded, actual, at_points, face.normal, SPACING, cutoff, kept),
        axis=np.full(count, "z"),
        zeros=np.ones((count, 1)),
        zero_sd=np.array([ZERO]),
        coordinates={"axis": np.full(count, "z"), "s_mm": x[kept] / MM, "x_mm": x[kept] / MM},
    )


def report(
    batch: Batch,
    observed: Mapping[str, pd.DataFrame],
    _identified: JSON,
    task: Problem | Refusal,
    fit: BaseFit | None,
) -> JSON:
    """Return the ``arm`` block: joint stiffnesses, and what is known of each run.

    Joint stiffnesses come from the fit, or from the load tests alone where no wall could be compared.
    """
    lacking = {"clock_offset_s": "needs the joint_force observable, which is not computed yet"}
    block: JSON = {}
    stiffness = _stiffness(batch, observed, fit)
    if isinstance(stiffness, Refusal):
        lacking["joint_stiffness"] = stiffness.reason
    else:
        block["joint_stiffness"] = stiffness
    if "tip_force" in observed:
        groups = observed["tip_force"].groupby("run", sort=False)
        block["tip_force"] = {run: _mean_force(wall(batch, str(run)), rows) for run, rows in groups}
    if "observability" in observed:
        groups = observed["observability"].groupby("run", sort=False)
        block["observability"] = {run: [float(value) for value in rows["index"]] for run, rows in groups}
    if isinstance(task, Problem) and isinstance(task.base, DeformationModel) and fit is not None:
        model = task.base
        walls = [one for one in task.blocks if isinstance(one.setting, CutWall)]
        block["deformation"] = {one.run: _deformation(model, one.setting, fit) for one in walls}
        points = observed["profile_points"].groupby("run", sort=False)
        block["waviness"] = {run: _waviness(rows) for run, rows in points}
    else:
        lacking["deformation"] = task.reason if isinstance(task, Refusal) else "no run to fit"
    return {"arm": {**block, "not_identified": lacking}}


def _stiffness(
    batch: Batch, observed: Mapping[str, pd.DataFrame], fit: BaseFit | None
) -> list[JSON] | Refusal:
    """Joint stiffnesses k = 1/c; without a value where a joint's compliance is not told from zero."""
    if fit is not None:
        value, sd, dof = fit.beta, np.sqrt(np.diag(fit.covariance)), fit.dof
    else:
        arm = arm_of_cell(batch.cell, batch.manifest)
        tests = (
            Refusal("no arm.dh")
            if arm is None
            else fitted_loads(DeformationModel(arm), observed["arm_loads"])
        )
        if isinstance(tests, Refusal):
            return tests
        value, sd, dof = tests.value, tests.sd, float(tests.dof)
    told = value > 2.0 * sd
    known = np.where(told, value, np.nan)
    return [quantity(1.0 / c, s / c**2, "N m/rad", dof) for c, s in zip(known, sd, strict=True)]


def _mean_force(face: Wall, rows: pd.DataFrame) -> JSON:
    """Mean of the steady cut; its error is taken to be the same all along, as a wrong zero of a torque is."""
    steady = rows[face.steady(rows["x_mm"].to_numpy() * MM)]
    return {
        axis: quantity(float(steady[name].mean()), float(steady[f"sd_{name}"].mean()), "N")
        for axis, name in zip("xyz", FORCE, strict=True)
    }


def _deformation(model: DeformationModel, setting: CutWall, fit: BaseFit) -> JSON:
    """Mean deflection of the tip where the wall is compared, work frame, by the fitted base model."""
    each = model.contributions(setting.commanded, setting.force)[setting.kept].mean(axis=0)
    mean = model.deflection(setting, fit.beta)[setting.kept].mean(axis=0)
    sd = np.sqrt(np.einsum("ai,ij,aj->a", each, fit.covariance, each))
    return {
        axis: quantity(value / MM, error / MM, "mm", fit.dof)
        for axis, value, error in zip("xyz", mean, sd, strict=True)
    }


def _waviness(rows: pd.DataFrame) -> JSON:
    """Wa (mean deviation, µm) of the wall and of the tip's tracking error, and how alike they are."""
    measured, predicted = rows["waviness_mm"].to_numpy(), rows["tracking_waviness_mm"].to_numpy()
    wa = {"wa_predicted": np.mean(np.abs(predicted)), "wa_measured": np.mean(np.abs(measured))}
    alike = np.corrcoef(measured, predicted)[0, 1] if predicted.std() > 0 < measured.std() else None
    written: JSON = {name: quantity(float(value) * MM / UM, float("nan"), "um") for name, value in wa.items()}
    return {**written, "correlation": None if alike is None else float(alike)}
