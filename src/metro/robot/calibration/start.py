"""Where a fit starts: the nominal rows, base and tool by the poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from metro.robot.calibration.fit import Fit, fitted
from metro.robot.calibration.model import State
from metro.robot.calibration.poses import Poses
from metro.robot.calibration.rows import standard_rows
from metro.robot.kinematics import Geometry
from metro.units import Array

LEAST = 1e-3  # m, standard deviation of the points across their line: nearer to it they lie on one


def nominal(poses: Poses, geometry: Geometry) -> tuple[Fit, Array]:
    """Fit base and tool of the nominal geometry; return the vertical in the rows' base frame, too.

    A geometry's own base frame has the vertical as its z.
    """
    rows, place, prismatic = standard_rows(geometry)
    count, first = int(poses.point.max()) + 1, poses.first
    state = State(np.column_stack([rows, np.zeros(len(rows))]), prismatic, np.eye(4), np.zeros(3))
    base = _laid_on(state.position(first.q), first.at)
    state = replace(state, base=base, tool=_points(replace(state, base=base), poses, count))
    free = np.arange(state.head + 5 * len(rows)) < state.head
    return fitted(poses, state, free), place[2, :3]


def _points(state: State, poses: Poses, count: int) -> Array:
    """Return where to start with the points on the flange: (3,) of one, (count, 3) of several."""
    if count == 1:
        return np.zeros(3)
    last = state.frames(poses.q)[0][-1]
    seen = np.einsum("mji,mj->mi", last[:, :3, :3], poses.at - last[:, :3, 3])
    return np.array([np.median(seen[poses.point == one], axis=0) for one in range(count)])


def _laid_on(points: Array, onto: Array) -> Array:
    """Return the motion (4, 4) that lays points (m, 3) on others, by least squares (Kabsch).

    Raises
    ------
    ValueError
        Where the points lie on a line, about which any turn does.
    """
    from scipy.spatial.transform import Rotation

    first, second = points.mean(axis=0), onto.mean(axis=0)
    across = np.linalg.svd(points - first, compute_uv=False)[1] / np.sqrt(len(points))
    if across < LEAST:
        raise ValueError("the joints move the point along one line at most, expected two directions or more")
    turn = Rotation.align_vectors(onto - second, points - first)[0].as_matrix()
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = turn, second - turn @ first
    return motion
