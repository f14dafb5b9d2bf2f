"""What the report shows of the robot beyond the observables: sensorless force, stiffness, path error.

Tables ``robot_force`` and ``robot_means`` (the force along the path, its steady mean beside the
dynamometer's), ``robot_joints`` (observability, noise, whiteness), ``robot_spectra`` and ``robot_lines`` (of
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
from metro.observables import tip_force
from metro.observables.joint_force import REPEATABLE
from metro.observables.problem import Refusal
from metro.observables.tip_force import FORCE, JOINTS, Log, Sensorless
from metro.observables.wall import Wall, wall
from metro.observables.waviness_points import GRID as SPACING
from metro.observables.waviness_points import IDLE, STRAYED
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
)  # points of the map along an edge; how far it reaches beyond the work, share of its size


def robot_tables(
    batch: Batch, read: Tables, identified: JSON, points: pd.DataFrame | None
) -> dict[str, pd.DataFrame]:
    """Return the tables that a batch with an arm has; none without one.

    ``points``: the observed ``waviness_points``; None where there are none.
    """
    arm = arm_of_cell(batch.cell, batch.manifest)
    if arm is None:
        return {}
    parts: dict[str, list[pd.DataFrame]] = {}
    start = None
    logged = set(read("robot")["run"].astype(str))
    found: dict[str, _Found] = {}
    for run in [str(r) for r in batch.runs.sort_values("order", kind="stable").index if str(r) in logged]:
        cut, idle = tip_force.logs(read("robot", run), arm)
        if not len(cut.tip):
            continue
        start = cut.commanded[len(cut.commanded) // 2] if start is None else start
        found[run] = _found(cut, idle, arm, wall(batch, run))
        _add(parts, run, _spectra(cut, arm))
    told = [one.told.wander for one in found.values() if isinstance(one.told, Sensorless)]
    # one run tells little of its slow noise: all of them together do
    wander = np.mean(told, axis=0) if told else np.zeros(len(JOINTS))
    for run, one in found.items():
        _add(parts, run, _forces(batch, run, read, one, wander))
    tables = {name: pd.concat(tables, ignore_index=True) for name, tables in parts.items()}
    if points is not None:
        tables["robot_waves"] = _waves(batch, points)
    return tables | _stiffness(batch, read, arm, start, identified)


def _add(parts: dict[str, list[pd.DataFrame]], run: str, tables: dict[str, pd.DataFrame]) -> None:
    for name, table in tables.items():
        parts.setdefault(name, []).append(table.assign(run=run))


@dataclass(frozen=True, eq=False)
class _Found:
    """Sensorless force of a run, whether its joints pass the index, and how sure friction is, (6,) N m."""

    told: Sensorless | Refusal
    by_index: bool
    friction: Array


def _found(cut: Log, idle: Log, arm: Arm, face: Wall) -> _Found:
    """Solve for the force of a run; where the joints that pass the index cannot tell it, from all joints."""
    told = tip_force.sensorless(cut, idle, arm, face)
    by_index = not isinstance(told, Refusal) and told.found is not None
    if not by_index:
        told = tip_force.sensorless(cut, idle, arm, face, 0.0)
    return _Found(told, by_index, REPEATABLE * np.sqrt(noise_variance(cut.torque)))


def _forces(batch: Batch, run: str, read: Tables, one: _Found, wander: Array) -> dict[str, pd.DataFrame]:
    """Tables of the sensorless force of a run, or why there is none; ``wander`` (6,) of all runs."""
    told = one.told
    if isinstance(told, Refusal):
        return {"robot_refused": pd.DataFrame({"reason": [told.reason]})}
    used = told.index >= LEAST_INDEX if told.found is None else told.found.used
    joints = pd.DataFrame(
        {
            "joint": list(JOINTS),
            "index": told.index,
            "used": used,
            "noise_nm": np.sqrt(told.torques.noise),
            "drift_nm": np.sqrt(told.torques.drift),
            "whiteness": told.torques.whiteness,
            "remark": "; ".join(told.remarks),
        }
    )
    if told.found is None:
        return {"robot_joints": joints, "robot_refused": pd.DataFrame({"reason": [told.refusal]})}
    sd = np.sqrt(np.einsum("maa->ma", told.found.covariance))
    names = knees(told.x, told.found.force).names(told.x)
    course = pd.DataFrame({"x_mm": told.x / MM, "part": names})
    course[FORCE], course[[f"sd_{name}" for name in FORCE]] = told.found.force, sd
    mean, covariance = mean_force(told.found, told.torques, told.steady, one.friction, wander)
    means = _means(batch, run, read, mean, np.sqrt(np.diag(covariance))).assign(by_index=one.by_index)
    return {"robot_joints": joints, "robot_force": course, "robot_means": means}


def _means(batch: Batch, run: str, read: Tables, mean: Array, sd: Array) -> pd.DataFrame:
    """Mean force (3,) of the steady cut by axis, its standard errors, and the dynamometer's where it is."""
    table = pd.DataFrame({"axis": list("xyz"), "sensorless_n": mean, "sensorless_sd_n": sd})
    record = tip_force.from_dynamometer(batch, run, read, wall(batch, run))
    if isinstance(record, Refusal):
        return table.assign(dynamometer_n=np.nan, dynamometer_sd_n=np.nan)
    measured = record[FORCE].to_numpy(dtype=float)[0]
    own = record[[f"sd_{name}" for name in FORCE]].to_numpy(dtype=float)[0]
    return table.assign(dynamometer_n=measured, dynamometer_sd_n=np.hypot(own, CALIBRATED * np.abs(measured)))


def _spectra(cut: Log, arm: Arm) -> dict[str, pd.DataFrame]:
    """Spectra of the tip's tracking error (encoder less set), work frame, over time and along the path."""
    error = arm.tip(cut.actual) - cut.tip
    place = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(cut.tip, axis=0), axis=1))])
    spectra, lines = [], []
    for domain, along, unit in (("time", cut.time, 1.0), ("path", place, MM)):
        even, spacing = even_samples(along, error)
        for axis, channel in zip("xyz", even.T, strict=True):
            try:
                found = spectrum(channel, spacing)
            except ValueError:
                continue
            keep = slice(FINER, None, FINER)  # the zero padding is finer than the record resolves
            density = {
                "frequency": found.frequency[keep] * unit,
                "density_um2": found.density[keep] / UM**2 / unit,
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
                for line in found.lines
            ]
    tables = {"robot_spectra": pd.concat(spectra, ignore_index=True)} if spectra else {}
    return tables | ({"robot_lines": pd.DataFrame(lines)} if lines else {})


def _waves(batch: Batch, points: pd.DataFrame) -> pd.DataFrame:
    """Waves of the wall, and of the tip's tracking error through the profile's filter, away from the ends."""
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
        found, sd = ellipsoid(arm, q, compliance), principal_sd(arm, q, compliance, covariance)
        for k in range(3):
            axis = dict(zip(("axis_x", "axis_y", "axis_z"), found.axes[:, k], strict=True))
            rows.append(
                {"pose": pose, "stiffness_n_um": found.principal[k] / N_UM, "sd_n_um": sd[k] / N_UM, **axis}
            )
    return {"arm_map": _map(batch, arm, first, compliance), "arm_ellipsoids": pd.DataFrame(rows)}


def _map(batch: Batch, arm: Arm, q: Array, compliance: Array) -> pd.DataFrame:
    """Stiffness on a grid over the work and half its size beyond, at the tip's height, tool held as there."""
    tip = arm.tip(q)
    size = (
        np.asarray((batch.manifest.get("work") or {}).get("size_mm", (200.0, 200.0, 0.0)), dtype=float) * MM
    )
    low, high = -MARGIN * size[:2], (1 + MARGIN) * size[:2]
    low, high = np.minimum(low, tip[:2] - 0.1), np.maximum(high, tip[:2] + 0.1)
    x, y = (np.linspace(a, b, GRID) for a, b in zip(low, high, strict=True))
    place = np.stack(np.meshgrid(x, y, [tip[2]], indexing="ij"), axis=-1).reshape(-1, 3)
    found = stiffness_map(arm, q, place, compliance)
    columns = {f"{axis}_mm": column / MM for axis, column in zip("xyz", place.T, strict=True)}
    columns |= {f"k{axis}_n_um": k / N_UM for axis, k in zip("xyz", found.stiffness.along.T, strict=True)}
    columns["k_least_n_um"] = found.stiffness.principal[:, 0] / N_UM
    axes: Any = found.stiffness.axes[:, :, 0]
    columns |= {f"soft_{axis}": part for axis, part in zip("xyz", axes.T, strict=True)}
    return pd.DataFrame({**columns, "condition": found.condition})


def _compliance(batch: Batch, identified: JSON) -> tuple[Array | None, Array]:
    """Joint compliances (6,) and their covariance: as identified, else of the cell file; None where unknown.

    A joint that was not told from rigid is rigid.
    """
    told = (identified.get("arm") or {}).get("joint_stiffness")
    known = batch.cell.get("joint_stiffness_nm_rad")
    if told:
        value = np.array([_number(q.get("value")) for q in told])
        low = np.array([_number((q.get("ci95") or [None])[0]) for q in told])
        sd = np.nan_to_num((value - low) / 1.96 / value**2)
        return np.nan_to_num(1.0 / value), np.diag(sd**2)
    if known is None:
        return None, np.zeros((len(JOINTS), len(JOINTS)))
    return 1.0 / np.asarray(known, dtype=float), np.zeros((len(JOINTS), len(JOINTS)))


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else np.nan
