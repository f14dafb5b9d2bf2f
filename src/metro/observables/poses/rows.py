"""A canonical table of measured poses as poses in SI: of one point, of several, or with orientations.

An orientation is as good as two more points: those that lie :data:`LEVER` beside the measured one along x and
y of the measured frame. How that frame sits on the flange is then as free as where each of the points is.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.joint_columns import PLACE, axes_of
from metro.robot.calibration.poses import Poses, approached, evenly
from metro.robot.calibration.start import nominal
from metro.robot.kinematics import Geometry
from metro.robot.orientation import matrix_of_quaternion
from metro.units import DEG, MM, Array

LEVER = 0.1  # m: a tracker with 0.03 mm and 0.3 mrad measures these points as well as the first
SOME, WORSE = 200, 3.0  # poses that are tried; times the scatter of the best order, from which on it is wrong
SIGMAS = ("sigma_x_mm", "sigma_y_mm", "sigma_z_mm")
ANGLES, QUATERNION = ("rx_deg", "ry_deg", "rz_deg"), ("q1", "q2", "q3", "q4")
FIXED_AXES = "xyz"  # R = R_z(rz) R_y(ry) R_x(rx), as everywhere in the contract


def euler_of(batch: Batch) -> str:
    """Return the order of turns of the instrument's angles: xyz about fixed axes, XYZ about turning ones."""
    return str(batch.instrument("tracker").get("euler") or FIXED_AXES)


def poses_of(rows: pd.DataFrame, euler: str = FIXED_AXES) -> tuple[Poses, Array]:
    """Return poses, and of each row the number of the commanded pose (NaN where it has none).

    A pose without a time has its number.
    """
    axes = axes_of(rows)
    q = rows[axes.positions].to_numpy(dtype=float) * axes.units
    at = rows[list(PLACE)].to_numpy(dtype=float) * MM
    point = np.nan_to_num(rows["point"].to_numpy(dtype=float), nan=1.0).astype(int)
    point = np.unique(point, return_inverse=True)[1].ravel()
    pose = _poses(q, point, rows["station"].to_numpy(dtype=float))
    time = rows["t_s"].to_numpy(dtype=float)
    time = time if np.isfinite(time).all() else pose.astype(float)
    sigma = np.nan_to_num(_sigma(rows)) * MM
    warm = rows["temperature_c"].to_numpy(dtype=float)
    # A tracker may state the distance, too; it counts where there is no position.
    distance = np.where(np.isnan(at).any(axis=1), rows["distance_mm"].to_numpy(dtype=float) * MM, np.nan)
    station = np.nan_to_num(rows["station"].to_numpy(dtype=float), nan=1.0).astype(int)
    station = np.unique(station, return_inverse=True)[1].ravel()
    payload = np.nan_to_num(rows["payload_kg"].to_numpy(dtype=float))
    found = Poses(q, at, sigma, time, warm, approached(q), pose, point, distance, station, payload)
    target, turn = rows["target"].to_numpy(dtype=float), _orientation(rows, euler)
    if turn is None or found.by_distance:  # points beside one of which the distance is known have none
        return found, target
    again = np.repeat(np.arange(len(q)), 3)
    beside = np.stack([np.zeros_like(at), turn[:, :, 0], turn[:, :, 1]], axis=1).reshape(-1, 3)
    places = found.point[again] * 3 + np.tile(np.arange(3), len(q))
    more = found.of(again)
    return replace(more, at=more.at + LEVER * beside, point=places), target[again]


def misread(rows: pd.DataFrame, euler: str, geometry: Geometry) -> str:
    """Say that the angles were turned in another order than is stated; "" where they were not.

    A wrong order has the points beside the measured one centimetres from where the arm has them.
    """
    if rows[[*ANGLES, *PLACE]].isna().to_numpy().any():
        return ""
    some = rows.iloc[evenly(len(rows), SOME)]
    scatter = {
        order: nominal(poses_of(some, order)[0], geometry)[0].scale
        for order in (euler, *map("".join, permutations(FIXED_AXES)))
    }
    best = min(scatter, key=lambda order: scatter[order])
    if scatter[euler] <= WORSE * scatter[best]:
        return ""
    found, other = (f"{scatter[order] / MM:.3g} mm" for order in (euler, best))
    turning = best[::-1].upper()
    return (
        f"rx_deg, ry_deg and rz_deg fit the arm to {found} in the order {euler} and to {other} in the order "
        f"{best} (about turning axes {turning}): state instruments.tracker.euler in batch.yaml"
    )


def _sigma(rows: pd.DataFrame) -> Array:
    """Return the standard deviation of a coordinate (m,), mm: as stated, or rms of those of x, y and z."""
    each = rows[list(SIGMAS)].to_numpy(dtype=float)
    stated = rows["sigma_mm"].to_numpy(dtype=float)
    return np.where(np.isnan(stated), np.sqrt(np.mean(each**2, axis=1)), stated)


def _poses(q: Array, point: np.ndarray, station: Array) -> np.ndarray:
    """Return numbers of poses (m,): that of the row before where joints are the same.

    Its point is then a later one, or its station.
    """
    later = (point[1:] > point[:-1]) | ((point[1:] == point[:-1]) & (station[1:] > station[:-1]))
    same = (q[1:] == q[:-1]).all(axis=1) & later
    return np.concatenate([[0], np.cumsum(~same)])


def _orientation(rows: pd.DataFrame, euler: str) -> Array | None:
    """Return the measured orientations (m, 3, 3); None where the table has none."""
    from scipy.spatial.transform import Rotation

    quaternion = rows[list(QUATERNION)].to_numpy(dtype=float)
    if np.isfinite(quaternion).all():
        return matrix_of_quaternion(quaternion)
    angles = rows[list(ANGLES)].to_numpy(dtype=float) * DEG
    if not np.isfinite(angles).all():
        return None
    order = ["xyz".index(axis) for axis in euler.lower()]
    return np.asarray(Rotation.from_euler(euler, angles[:, order]).as_matrix())
