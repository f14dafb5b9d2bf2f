"""Standard Denavit–Hartenberg rows of any chain, by the lines of its axes.

The base frame and the tool are free in a calibration, so that of a chain in another convention (modified
rows, URDF) only the lines of the axes matter. The rows follow from them by common normals.
"""

from __future__ import annotations

import numpy as np

from metro.robot.chain import Chain
from metro.robot.kinematics import Geometry, prismatic
from metro.units import Array

PARALLEL = 1e-9  # sine of the angle between axes below which they are taken as parallel


def standard_rows(geometry: Geometry) -> tuple[Array, Array, np.ndarray]:
    """Return standard rows with the same axes, the place of their base, and which joints shift.

    Returns
    -------
    rows : (n, 4) θ₀, α (rad), d, a (m). place : (4, 4) of the rows' base frame in that of the geometry.
        prismatic : (n,) bool.

    The frame behind the last joint is that of the geometry's flange where it is a set of rows already; of a
    chain it has the origin of the last axis' frame, turned as is easiest: a tool is to be fitted to it.
    """
    if not isinstance(geometry, Chain):
        return np.asarray(geometry, dtype=float), np.eye(4), prismatic(geometry)
    frames = geometry.frames(np.zeros(len(geometry)))
    axes, points = frames[:-1, :3, 2], frames[:-1, :3, 3]
    place = frames[0].copy()
    frame, rows = place, []
    for axis, point in zip([*axes[1:], frames[-1, :3, 2]], [*points[1:], frames[-1, :3, 3]], strict=True):
        row, frame = _row(frame, axis, point)
        rows.append(row)
    return np.array(rows), place, geometry.prismatic


def _row(frame: Array, axis: Array, point: Array) -> tuple[Array, Array]:
    """Return the row from a frame to the next axis, and the frame that it leads to."""
    (x, y, z), origin = frame[:3, :3].T, frame[:3, 3]
    across = np.cross(z, axis)
    sine, cosine = float(np.linalg.norm(across)), float(z @ axis)
    if sine > PARALLEL:
        normal = across / sine
        gap = point - origin
        length = float(gap @ normal)
        offset = float(np.cross(gap, axis) @ across) / sine**2
    else:
        gap = point - origin
        side = gap - (gap @ z) * z
        length, offset = float(np.linalg.norm(side)), float(gap @ z)
        normal = side / length if length > PARALLEL else x
    theta = float(np.arctan2(normal @ y, normal @ x))
    alpha = float(np.arctan2(np.cross(z, axis) @ normal, cosine))
    found = np.eye(4)
    found[:3, 0], found[:3, 2] = normal, axis
    found[:3, 1] = np.cross(axis, normal)
    found[:3, 3] = origin + offset * z + length * normal
    return np.array([theta, alpha, offset, length]), found
