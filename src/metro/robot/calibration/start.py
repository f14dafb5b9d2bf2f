"""Where a fit starts: the nominal rows, base and tool by the poses."""

from __future__ import annotations

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
    state = State(np.column_stack([rows, np.zeros(len(rows))]), prismatic, np.eye(4), np.zeros(3))
    state = State(state.rows, prismatic, _laid_on(state.position(poses.q), poses.at), state.tool)
    free = np.zeros(9 + 5 * len(rows), dtype=bool)
    free[:9] = True
    return fitted(poses, state, free), place[2, :3]


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
