"""Tables of the robot for the report, beyond the observables: sensorless force, stiffness, path error.

Those of :mod:`metro.observables.arm.force_tables` and :mod:`metro.observables.arm.tracking_tables`,
``arm_map`` and ``arm_ellipsoids`` (stiffness over the work), ``robot_waves`` (walls and tips, filtered).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.joint_columns import numbered
from metro.observables.arm.force_by_torques import gain_errors
from metro.observables.arm.force_tables import RunForce, aligned, force_tables, logged_cuts, run_force
from metro.observables.arm.load_tests import joint_places
from metro.observables.arm.tip_force import Log, Sensorless
from metro.observables.arm.tracking_tables import tracking_tables
from metro.observables.arm.wall import Wall, wall
from metro.observables.waviness.points import GRID as SPACING
from metro.observables.waviness.points import IDLE, STRAYED
from metro.robot.kinematics import Arm, arm_of_cell
from metro.robot.workspace import ellipsoid, principal_sd, stiffness_map
from metro.surface.profile import part
from metro.units import JSON, MM, N_UM, Array

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
    solved: dict[str, RunForce] = {}
    for run, cut, idle in logged_cuts(batch, read, arm):
        face = wall(batch, run)
        start = cut.commanded[len(cut.commanded) // 2] if start is None else start
        solved[run] = run_force(batch, cut, idle, arm, face)
        first = "robot_aligned" not in parts and isinstance(solved[run].sensorless, Sensorless)
        tables = {"robot_aligned": _aligned(cut, idle, face, solved[run])} if first else {}
        tracked = tracking_tables(cut, idle, arm, face) if cut.followed else {}
        for name, table in (tables | tracked).items():
            parts.setdefault(name, []).append(table.assign(run=run))
    parts |= force_tables(batch, read, solved, gain_errors(batch, identified, arm)[0])
    tables = {name: pd.concat(tables, ignore_index=True) for name, tables in parts.items()}
    if points is not None:
        tables["robot_waves"] = _waves(batch, points)
    return tables | _stiffness(batch, read, arm, start, identified)


def _aligned(cut: Log, idle: Log, face: Wall, one: RunForce) -> pd.DataFrame:
    """Return the logs of the joint whose torque the cut changes most."""
    assert isinstance(one.sensorless, Sensorless)
    place = int(np.argmax(one.sensorless.index))
    return aligned(cut, idle, face, int(one.sensorless.joints[place]), place)


def _waves(batch: Batch, points: pd.DataFrame) -> pd.DataFrame:
    """Waves of the wall and, through the same filter, of the tip's tracking error, away from the ends."""
    cutoff = float(batch.instrument("profiler").get("cutoff_mm", 8.0)) * MM
    parts = []
    for run, rows in points.groupby("run", sort=False):
        sums = [rows[numbered(form, rows)].sum(axis=1, skipna=False) for form in (STRAYED, IDLE)]
        strayed = np.column_stack(sums)
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
    loads = read("loads").dropna(subset=arm.axes.positions)
    poses = {
        f"load tests {name}": joint_places(rows, arm)[0] for name, rows in loads.groupby("pose", sort=False)
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
    """Joint compliances (n,) and their covariance: identified, else from the cell file; None if unknown.

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
        return None, np.zeros((0, 0))
    return 1.0 / np.asarray(known, dtype=float), np.zeros((len(known), len(known)))


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else np.nan
