"""Corrected targets of a batch, in the columns of the contract, with the errors that remain."""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.joint_columns import PLACE, TURNED, axes_of
from metro.robot.calibration.compensation import corrected
from metro.robot.calibration.held_out import HeldOut
from metro.robot.calibration.poses import Poses
from metro.robot.calibration.study import Calibration
from metro.robot.inverse import joints_at, nearest_joints
from metro.robot.kinematics import Arm, arm_of_cell
from metro.robot.orientation import euler_of_matrix, matrix_of_euler
from metro.units import DEG, JSON, MM, Array

MRAD = 1e-3


def corrected_targets(
    batch: Batch,
    rows: pd.DataFrame,
    found: Calibration,
    *,
    poses: Poses,
    held: tuple[HeldOut, ...],
) -> tuple[pd.DataFrame, JSON]:
    """Return the table of corrected targets of a run, and what ``identified.json`` says of it.

    ``q1_deg`` …: what to command; ``q1_target_deg`` …: what was asked for. Of places of the tip ``x_mm`` …
    ``rz_deg`` and ``x_target_mm`` … are the same for a controller that computes the joints itself.

    Raises
    ------
    ValueError
        Where the declared arm does not reach a place.
    """
    run, axes = str(rows["run"].iloc[0]), axes_of(rows)
    arm = None if len(axes) else arm_of_cell(batch.cell, batch.manifest)
    if arm is None:
        q = rows[axes.positions].to_numpy(dtype=float) * axes.units
    else:
        axes, q = arm.axes, joints_at(arm, *_places(rows, arm, poses))
    one = corrected(q, found.fits[0], found.final, poses, held)
    table = pd.DataFrame(one.q / axes.units, columns=axes.positions)
    for name, values in zip(axes.positions, (q / axes.units).T, strict=True):
        joint, unit = name.split("_")
        table[f"{joint}_target_{unit}"] = values
    if arm is not None:
        table = table.assign(**_placed(arm, one.q, "{}_{}"), **_placed(arm, q, "{}_target_{}"))
    after = dict(zip(("after_mm", "after_low_mm", "after_high_mm"), one.after.T / MM, strict=True))
    table = table.assign(
        run=run,
        target=np.arange(1, len(q) + 1),
        before_mm=one.before / MM,
        **after,
        turned_mrad=one.turned / MRAD,
        inside=one.inside,
    )
    summary: JSON = {
        "targets": len(q),
        "before": {"value": float(np.median(one.before)) / MM, "unit": "mm"},
        "after": _median(table),
        "turned": {"value": float(np.max(one.turned)) / MRAD, "unit": "mrad"},
        "outside": int((~one.inside).sum()),
    }
    return table, summary


def _places(rows: pd.DataFrame, arm: Arm, poses: Poses) -> tuple[Array, Array, Array]:
    """Return places (m, 3), turns (m, 3, 3) and the joints to begin with, those of the nearest pose.

    Without angles the flange stays turned as it is in that pose.
    """
    at = rows[list(PLACE)].to_numpy(dtype=float) * MM
    angles = rows[list(TURNED)].to_numpy(dtype=float) * DEG
    turns = matrix_of_euler(angles) if np.isfinite(angles).all() else None
    start = nearest_joints(arm, at[0], None if turns is None else turns[0], poses.q)
    kept = np.repeat(arm.flange_axes(start)[None], len(at), axis=0)
    return at, kept if turns is None else turns, start


def _placed(arm: Arm, q: Array, form: str) -> dict[str, Array]:
    """Return columns of where the declared arm has the tip at joints, and how the flange is turned there."""
    values = np.hstack([arm.tip(q) / MM, euler_of_matrix(arm.flange_axes(q)) / DEG])
    return {
        form.format(*name.split("_")): column
        for name, column in zip((*PLACE, *TURNED), values.T, strict=True)
    }


def _median(table: pd.DataFrame) -> JSON:
    """Return the median over the targets of the remaining error, and of the ends of its interval."""
    value, low, high = (float(table[f"after{end}_mm"].median()) for end in ("", "_low", "_high"))
    return {"value": value, "ci95": [low, high], "unit": "mm"}
