"""The steady force on the tip by the torques of the joints, of runs without a dynamometer."""

from __future__ import annotations

from typing import Any

import numpy as np

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.observables.arm.force_tables import RunForce, force_tables, logged_cuts, run_force
from metro.observables.arm.wall import wall
from metro.observables.quantity import quantity
from metro.robot.drives import declared, drives_of_cell
from metro.robot.kinematics import Arm, arm_of_cell
from metro.units import JSON, Array


def force_without_dynamometer(batch: Batch, read: Tables, identified: JSON) -> JSON:
    """Return parts of the block ``arm``; {} where every logged run has a dynamometer.

    ``tip_force_by_torques``: of each run ``x``, ``y``, ``z`` (N, work frame, force on the tool, mean of the
    steady cut). ``tip_force_by_torques_about``: the largest ``condition`` number of each, why others were
    ``refused``, and ``gain_from``, where the uncertainty of the torques is from. It is what the cell declares
    of its drives, else that of the factor that other runs' dynamometer gave, else what is assumed of drives.
    """
    arm = arm_of_cell(batch.cell, batch.manifest)
    alone = set(batch.with_files("robot_log", "idle_log")) - set(batch.with_files("dynamometer"))
    if arm is None or not alone:
        return {}
    solved: dict[str, RunForce] = {
        run: run_force(batch, cut, idle, arm, wall(batch, run))
        for run, cut, idle in logged_cuts(batch, read, arm)
    }
    drives, source = gain_errors(batch, identified, arm)
    tables = force_tables(batch, read, solved, drives)
    found: JSON = {}
    about: JSON = {"gain_from": source, "condition": {}, "refused": {}}
    for means in tables.get("robot_means", []):
        run = str(means["run"].iloc[0])
        if run in alone:
            rows: Any = means[means["frame"] == "work"].set_index("axis")
            about["condition"][run] = float(rows["condition"].iloc[0])
            found[run] = {axis: _quantity(rows.loc[axis]) for axis in "xyz"}
    for refused in tables.get("robot_refused", []):
        run = str(refused["run"].iloc[0])
        if run in alone:
            about["refused"][run] = str(refused["reason"].iloc[0])
    return {"tip_force_by_torques": found, "tip_force_by_torques_about": about}


def _quantity(row: Any) -> JSON:
    """Return the force along an axis, the errors of noise and friction and those of the drives in it."""
    return quantity(row["sensorless_n"], float(np.hypot(row["sensorless_sd_n"], row["drives_sd_n"])), "N")


def gain_errors(batch: Batch, identified: JSON, arm: Arm) -> tuple[Array, str]:
    """Return the covariance (k, k) of the relative errors of the torques, and where it is from."""
    joints = arm.axes.turning
    gain = (identified.get("arm") or {}).get("torque_gain") or {}
    low, high = gain.get("ci95") or (None, None)
    if low is not None and high is not None and not declared(batch.cell):
        relative = np.hypot((high - low) / 3.92, float(gain["value"]) - 1.0)
        shared = np.full((len(joints), len(joints)), relative**2)
        return shared, "the dynamometer of other runs (torque_gain)"
    drives = drives_of_cell(batch.cell, len(arm.axes))
    return drives.covariance[np.ix_(joints, joints)], drives.source
