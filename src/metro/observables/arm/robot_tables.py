"""Tables of the robot for the report, beyond the observables: sensorless force, stiffness, path error.

Tables ``robot_force`` and ``robot_means`` (the force along the path, and its steady mean with that of the
dynamometer), ``robot_joints`` (observability, noise, whiteness), ``robot_spectra`` and ``robot_lines`` (of
the tip's tracking error), ``arm_map`` and ``arm_ellipsoids`` (stiffness over the work), ``robot_waves``
(walls and tips, filtered).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.observables.arm import tip_force
from metro.observables.arm.tip_force import FORCE, JOINTS, Log, Sensorless
from metro.observables.arm.wall import Wall, wall
from metro.observables.joint_force.observable import REPEATABLE
from metro.observables.problem import Refusal
from metro.observables.waviness.points import GRID as SPACING
from metro.observables.waviness.points import IDLE, STRAYED
from metro.robot.kinematics import Arm, arm_of_cell
from metro.robot.sensorless import LEAST_INDEX, mean_force
from metro.robot.workspace import ellipsoid, principal_sd, stiffness_map
from metro.signals.kalman import noise_variance
from metro.signals.path_spectrum import FINER, even_samples, spectrum
from metro.signals.segmentation import knees
from metro.surface.profile import part
from metro.units import JSON, MM, N_UM, UM, Array

CALIBRATED = tip_force.SYSTEMATIC["dynamometer"]
GRID, MARGIN = (
    13,
    0.5,
)  # points of the map along an edge; its margin around the work, as a share of the work's size


def robot_tables(
    batch: Batch, read: Tables, identified: JSON, points: pd.DataFrame | None
) -> dict[str, pd.DataFrame]:
    """Return the tables of a batch with an arm; no table without an arm.

    ``points``: the observed ``waviness_points``; None if there are none.
    """
    arm = arm_of_cell(batch.cell, batch.manifest)
    if arm is None:
        return {}
    parts: dict[str, list[pd.DataFrame]] = {}
    start = None
    logged = set(read("robot")["run"].astype(str))
    solved: dict[str, _RunForce] = {}
    for run in [str(r) for r in batch.runs.sort_values("order", kind="stable").index if str(r) in logged]:
        cut, idle = tip_force.logs(read("robot", run), arm)
        if not len(cut.tip):
            continue
        start = cut.commanded[len(cut.commanded) // 2] if start is None else start
        solved[run] = _run_force(cut, idle, arm, wall(batch, run))
        _add(parts, run, _spectra(cut, arm))
    wanders = [one.sensorless.wander for one in solved.values() if isinstance(one.sensorless, Sensorless)]
    # The slow noise of one run is poorly determined, so its level is the mean over all runs.
    wander = np.mean(wanders, axis=0) if wanders else np.zeros(len(JOINTS))
    for run, one in solved.items():
        _add(parts, run, _forces(batch, run, read, one, wander))
    tables = {name: pd.concat(tables, ignore_index=True) for name, tables in parts.items()}
    if points is not None:
        tables["robot_waves"] = _waves(batch, points)
    return tables | _stiffness(batch, read, arm, start, identified)


def _add(parts: dict[str, list[pd.DataFrame]], run: str, tables: dict[str, pd.DataFrame]) -> None:
    for name, table in tables.items():
        parts.setdefault(name, []).append(table.assign(run=run))


@dataclass(frozen=True, eq=False)
class _RunForce:
    """Sensorless force of a run, whether its joints pass the index, and the error of friction, (6,) N m."""

    sensorless: Sensorless | Refusal
    by_index: bool
    friction: Array


def _run_force(cut: Log, idle: Log, arm: Arm, face: Wall) -> _RunForce:
    """Solve for the force of a run from the joints that pass the index; if that fails, from all joints."""
    solved = tip_force.sensorless(cut, idle, arm, face)
    by_index = not isinstance(solved, Refusal) and solved.solution is not None
    if not by_index:
        solved = tip_force.sensorless(cut, idle, arm, face, 0.0)
    return _RunForce(solved, by_index, REPEATABLE * np.sqrt(noise_variance(cut.torque, cut.interval)))


def _forces(batch: Batch, run: str, read: Tables, one: _RunForce, wander: Array) -> dict[str, pd.DataFrame]:
    """Tables of the sensorless force of a run, or why there is none; ``wander`` (6,) is that of all runs."""
    sensorless = one.sensorless
    if isinstance(sensorless, Refusal):
        return {"robot_refused": pd.DataFrame({"reason": [sensorless.reason]})}
    used = sensorless.index >= LEAST_INDEX if sensorless.solution is None else sensorless.solution.used
    joints = pd.DataFrame(
        {
            "joint": list(JOINTS),
            "index": sensorless.index,
            "used": used,
            "noise_nm": np.sqrt(sensorless.torques.noise),
            "drift_nm": np.sqrt(sensorless.torques.drift),
            "whiteness": sensorless.torques.whiteness,
            "remark": "; ".join(sensorless.remarks),
        }
    )
    if sensorless.solution is None:
        return {"robot_joints": joints, "robot_refused": pd.DataFrame({"reason": [sensorless.refusal]})}
    sd = np.sqrt(np.einsum("maa->ma", sensorless.solution.covariance))
    names = knees(sensorless.x, sensorless.solution.force).names(sensorless.x)
    course = pd.DataFrame({"x_mm": sensorless.x / MM, "part": names})
    course[FORCE], course[[f"sd_{name}" for name in FORCE]] = sensorless.solution.force, sd
    mean, covariance = mean_force(
        sensorless.solution, sensorless.torques, sensorless.steady, one.friction, wander
    )
    means = _means(batch, run, read, mean, np.sqrt(np.diag(covariance))).assign(by_index=one.by_index)
    return {"robot_joints": joints, "robot_force": course, "robot_means": means}


def _means(batch: Batch, run: str, read: Tables, mean: Array, sd: Array) -> pd.DataFrame:
    """Mean force (3,) of the steady cut by axis with standard errors, and the dynamometer's if measured."""
    table = pd.DataFrame({"axis": list("xyz"), "sensorless_n": mean, "sensorless_sd_n": sd})
    record = tip_force.from_dynamometer(batch, run, read, wall(batch, run))
    if isinstance(record, Refusal):
        return table.assign(dynamometer_n=np.nan, dynamometer_sd_n=np.nan)
    measured = record[FORCE].to_numpy(dtype=float)[0]
    own = record[[f"sd_{name}" for name in FORCE]].to_numpy(dtype=float)[0]
    return table.assign(dynamometer_n=measured, dynamometer_sd_n=np.hypot(own, CALIBRATED * np.abs(measured)))


def _spectra(cut: Log, arm: Arm) -> dict[str, pd.DataFrame]:
    """Spectra of the tip's tracking error (encoder less set, work frame), over time and along the path."""
    error = arm.tip(cut.actual) - cut.tip
    place = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(cut.tip, axis=0), axis=1))])
    spectra, lines = [], []
    for domain, along, unit in (("time", cut.time, 1.0), ("path", place, MM)):
        even, spacing = even_samples(along, error)
        for axis, channel in zip("xyz", even.T, strict=True):
            try:
                resolved = spectrum(channel, spacing)
            except ValueError:
                continue
            keep = slice(FINER, None, FINER)  # the zero padding gives finer steps than the record resolves
            density = {
                "frequency": resolved.frequency[keep] * unit,
                "density_um2": resolved.density[keep] / UM**2 / unit,
            }
            spectra.append(pd.DataFrame({"domain": domain, "axis": axis, **density}))
            lines += [
                {
                    "domain": domain,
                    "axis": axis,
                    "frequency": line.frequency * unit,
                    "frequency_sd": line.frequency_sd * unit,
                    "amplitude_um": line.amplitude / UM,
                    "amplitude_sd_um": line.amplitude_sd / UM,
                    "probability": line.probability,
                }
                for line in resolved.lines
            ]
    tables = {"robot_spectra": pd.concat(spectra, ignore_index=True)} if spectra else {}
    return tables | ({"robot_lines": pd.DataFrame(lines)} if lines else {})


def _waves(batch: Batch, points: pd.DataFrame) -> pd.DataFrame:
    """Waves of the wall and, through the same filter, of the tip's tracking error, away from the ends."""
    cutoff = float(batch.instrument("profiler").get("cutoff_mm", 8.0)) * MM
    parts = []
    for run, rows in points.groupby("run", sort=False):
        strayed = np.column_stack([rows[STRAYED].sum(axis=1), rows[IDLE].sum(axis=1, skipna=False)])
        tip, idle = part(strayed, SPACING, cutoff).waviness.T
        columns = {"x_mm": rows["x_mm"], "wall_um": rows["waviness_um"], "tip_um": tip, "idle_um": idle}
        parts.append(pd.DataFrame({"run": run, **columns})[rows["kept"].to_numpy(dtype=bool)])
    return pd.concat(parts, ignore_index=True)


def _stiffness(
    batch: Batch, read: Tables, arm: Arm, start: Array | None, identified: JSON
) -> dict[str, pd.DataFrame]:
    """Stiffness of the tip around the work, and its ellipsoid in the first cut and each load pose."""
    compliance, covariance = _compliance(batch, identified)
    if compliance is None:
        return {}
    loads = read("loads").dropna(subset=[f"q{i}_deg" for i in JOINTS])
    poses = {
        f"load tests {name}": np.radians(rows[[f"q{i}_deg" for i in JOINTS]].to_numpy(dtype=float)[0])
        for name, rows in loads.groupby("pose", sort=False)
    }
    if start is not None:
        poses = {"cut": start, **poses}
    if not poses:
        return {}
    first = next(iter(poses.values()))
    rows: list[JSON] = []
    for pose, q in poses.items():
        stiffness, sd = ellipsoid(arm, q, compliance), principal_sd(arm, q, compliance, covariance)
        for k in range(3):
            axis = dict(zip(("axis_x", "axis_y", "axis_z"), stiffness.axes[:, k], strict=True))
            rows.append(
                {
                    "pose": pose,
                    "stiffness_n_um": stiffness.principal[k] / N_UM,
                    "sd_n_um": sd[k] / N_UM,
                    **axis,
                }
            )
    return {"arm_map": _map(batch, arm, first, compliance), "arm_ellipsoids": pd.DataFrame(rows)}


def _map(batch: Batch, arm: Arm, q: Array, compliance: Array) -> pd.DataFrame:
    """Stiffness on a grid over the work and half its size around it, at the tip's height and orientation."""
    tip = arm.tip(q)
    size = (
        np.asarray((batch.manifest.get("work") or {}).get("size_mm", (200.0, 200.0, 0.0)), dtype=float) * MM
    )
    low, high = -MARGIN * size[:2], (1 + MARGIN) * size[:2]
    low, high = np.minimum(low, tip[:2] - 0.1), np.maximum(high, tip[:2] + 0.1)
    x, y = (np.linspace(a, b, GRID) for a, b in zip(low, high, strict=True))
    place = np.stack(np.meshgrid(x, y, [tip[2]], indexing="ij"), axis=-1).reshape(-1, 3)
    mapped = stiffness_map(arm, q, place, compliance)
    columns = {f"{axis}_mm": column / MM for axis, column in zip("xyz", place.T, strict=True)}
    columns |= {f"k{axis}_n_um": k / N_UM for axis, k in zip("xyz", mapped.stiffness.along.T, strict=True)}
    columns["k_least_n_um"] = mapped.stiffness.principal[:, 0] / N_UM
    axes: Any = mapped.stiffness.axes[:, :, 0]
    columns |= {f"soft_{axis}": part for axis, part in zip("xyz", axes.T, strict=True)}
    return pd.DataFrame({**columns, "condition": mapped.condition})


def _compliance(batch: Batch, identified: JSON) -> tuple[Array | None, Array]:
    """Joint compliances (6,) and their covariance: identified, else from the cell file; None if unknown.

    A joint that could not be distinguished from a rigid one is rigid.
    """
    identified_stiffness = (identified.get("arm") or {}).get("joint_stiffness")
    known = batch.cell.get("joint_stiffness_nm_rad")
    if identified_stiffness:
        value = np.array([_number(q.get("value")) for q in identified_stiffness])
        low = np.array([_number((q.get("ci95") or [None])[0]) for q in identified_stiffness])
        sd = np.nan_to_num((value - low) / 1.96 / value**2)
        return np.nan_to_num(1.0 / value), np.diag(sd**2)
    if known is None:
        return None, np.zeros((len(JOINTS), len(JOINTS)))
    return 1.0 / np.asarray(known, dtype=float), np.zeros((len(JOINTS), len(JOINTS)))


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else np.nan
