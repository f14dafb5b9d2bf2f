"""Setting a cell up: tool and work from touched points, the payload from the torques ([F] section 2.5)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.observables.arm.load_tests import joint_places
from metro.observables.quantity import quantity
from metro.robot.drives import drives_of_cell
from metro.robot.kinematics import arm_of_cell
from metro.robot.orientation import matrix_of_euler, matrix_of_quaternion, quaternion_of_euler
from metro.robot.payload_identification import Carried, identify_payload
from metro.robot.touched import Placed, Touches, calibrate
from metro.units import DEG, JSON, MM, Array

ANGLES = ("rx", "ry", "rz")
INERTIA = ("xx", "xy", "xz", "yy", "yz", "zz")


def calibration(batch: Batch, read: Tables) -> JSON:
    """Return the block ``calibration`` of identified.json; {} for a batch that measured none of it.

    ``tool`` (x, y, z in the flange's frame), ``work`` (x, y, z, angles rx, ry, rz, ``quaternion`` in the
    base), ``touching`` (rms, dof, source of the errors), ``payload`` (mass, centre, inertia about it, in the
    flange's frame); ``not_identified`` with the reasons.
    """
    touches, torques = read("touches"), read("payload")
    block: JSON = {}
    missing: dict[str, str] = {}
    if len(touches):
        try:
            block |= _touched(batch, touches)
        except ValueError as reason:
            missing["tool and work"] = str(reason)
    if len(torques):
        try:
            block |= {"payload": _payload(batch, torques)}
        except ValueError as reason:
            missing["payload"] = str(reason)
    block |= {"not_identified": missing} if missing else {}
    return {"calibration": block} if block else {}


def touches_of(table: pd.DataFrame) -> Touches:
    """Return the rows of touches.csv in SI; each has a quaternion or angles."""
    angles = table[[f"{name}_deg" for name in ANGLES]].to_numpy(dtype=float) * DEG
    quaternion = table[["q1", "q2", "q3", "q4"]].to_numpy(dtype=float)
    by_angles = np.isfinite(angles).all(axis=1)
    turn = np.empty((len(table), 3, 3))
    turn[by_angles] = matrix_of_euler(angles[by_angles])
    turn[~by_angles] = matrix_of_quaternion(quaternion[~by_angles])
    place = table[["x_mm", "y_mm", "z_mm"]].to_numpy(dtype=float) * MM
    sigma = table["sigma_mm"].to_numpy(dtype=float) * MM
    return Touches(turn, place, list(table["touched"].astype(str)), sigma)


def _touched(batch: Batch, table: pd.DataFrame) -> JSON:
    declared = batch.manifest.get("tool_in_flange_mm")
    placed = calibrate(
        touches_of(table), None if declared is None else np.asarray(declared, dtype=float) * MM
    )
    dof = math.inf if placed.stated else placed.dof
    block: JSON = {
        "touching": {
            "rms": quantity(placed.rms / MM, math.nan, "mm"),
            "dof": placed.dof,
            "errors_from": "sigma_mm of touches.csv" if placed.stated else "the residuals",
        }
    }
    if placed.tip_covariance.any():
        block["tool"] = _along("xyz", placed.tip / MM, placed.tip_covariance / MM**2, "mm", dof)
    return block | ({"work": _work(placed, dof)} if placed.frame is not None else {})


def _work(placed: Placed, dof: float) -> JSON:
    assert placed.frame is not None
    origin, angles = placed.frame
    place, turn = placed.frame_covariance[:3, :3] / MM**2, placed.frame_covariance[3:, 3:] / DEG**2
    block = _along("xyz", origin / MM, place, "mm", dof) | _along(ANGLES, angles / DEG, turn, "deg", dof)
    return block | {"quaternion": [float(part) for part in quaternion_of_euler(angles)]}


def _along(names: str | tuple[str, ...], values: Array, covariance: Array, unit: str, dof: float) -> JSON:
    spread = np.sqrt(np.diag(covariance))
    return {name: quantity(v, s, unit, dof) for name, v, s in zip(names, values, spread, strict=True)}


def _payload(batch: Batch, table: pd.DataFrame) -> JSON:
    arm = arm_of_cell(batch.cell, batch.manifest)
    if arm is None:
        raise ValueError("the cell has no arm.dh: where the joints are is not known")
    axes, motion = arm.axes, None
    moved = [table[names] for names in (axes.rates, axes.accelerations)]
    if all(part.notna().all(axis=None) for part in moved):
        rate, acceleration = (part.to_numpy(dtype=float) * axes.units for part in moved)
        motion = rate, acceleration
    torque = table[axes.torques].to_numpy(dtype=float)
    loaded = table["loaded"].to_numpy() == "yes"
    carried = identify_payload(arm.dh, joint_places(table, arm), torque, loaded, motion)
    drives = drives_of_cell(batch.cell, len(axes))
    gain = float(drives.relative[axes.turning].max())
    joints = [place + 1 for place in axes.turning]
    return {**carried_json(with_gain(carried, gain), joints), "drives": drives.source}


def with_gain(carried: Carried, relative: float) -> Carried:
    """Return a load with an error in it by which all torques may be wrong alike: of mass and inertia.

    The centre of gravity is a ratio of moments, which such an error leaves alone.
    """
    size = np.concatenate([[carried.mass], np.zeros(3), carried.inertia])
    return replace(carried, covariance=carried.covariance + relative**2 * np.outer(size, size))


def carried_json(carried: Carried, joints: Sequence[int]) -> JSON:
    """Return a load as the block ``payload`` of identified.json; ``joints`` are those of its residuals."""
    spread = np.sqrt(np.diag(carried.covariance))
    centre = _along("xyz", carried.centre / MM, carried.covariance[1:4, 1:4] / MM**2, "mm", carried.dof)
    block: JSON = {"mass": quantity(carried.mass, spread[0], "kg", carried.dof), "centre": centre}
    if np.isfinite(carried.inertia).all():
        block["inertia"] = _along(INERTIA, carried.inertia, carried.covariance[4:, 4:], "kg m2", carried.dof)
    return block | {
        "joints": list(joints),
        "rms": [float(left) if np.isfinite(left) else None for left in carried.rms],
        "dof": carried.dof,
    }
