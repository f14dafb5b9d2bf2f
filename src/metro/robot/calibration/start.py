"""Where a fit starts: the nominal rows; base and tool by the poses, or tool and stations by distances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from metro.robot.calibration.fit import Fit, fitted
from metro.robot.calibration.model import State, free_of_geometry
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
    if poses.by_distance:
        state = _stationed(state, poses, count)
    else:
        base = _laid_on(state.position(first.q), first.at)
        state = replace(state, base=base, tool=_points(replace(state, base=base), poses, count))
    free = free_of_geometry(state) & (np.arange(state.head + 5 * len(rows)) < state.head)
    return fitted(poses, state, free), place[2, :3]


def placed(poses: Poses, geometry: Geometry) -> Poses:
    """Return poses of which all have a place: where distances were measured, that of the declared flange."""
    if not poses.by_distance:
        return poses
    rows, _, prismatic = standard_rows(geometry)
    state = State(np.column_stack([rows, np.zeros(len(rows))]), prismatic, np.eye(4), np.zeros(3))
    return replace(poses, at=state.position(poses.q))


def _points(state: State, poses: Poses, count: int) -> Array:
    """Return where to start with the points on the flange: (3,) of one, (count, 3) of several."""
    if count == 1:
        return np.zeros(3)
    last = state.frames(poses.q)[0][-1]
    seen = np.einsum("mji,mj->mi", last[:, :3, :3], poses.at - last[:, :3, 3])
    return np.array([np.median(seen[poses.point == one], axis=0) for one in range(count)])


def _stationed(state: State, poses: Poses, count: int) -> State:
    """Return the state with points on the flange and stations that suit measured distances.

    The stations are first found as if the points were in the last frame's origin, where they are linear in
    the squared distances' differences; from there points and stations are improved together.
    """
    from scipy.optimize import least_squares

    last = state.frames(poses.q)[0][-1]
    origin, turn = last[:, :3, 3], last[:, :3, :3]
    seen = int(poses.station.max()) + 1
    each = (poses.station == one for one in range(seen))
    stations = np.array([_trilaterated(origin[mine], poses.distance[mine]) for mine in each])

    def misses(values: Array) -> Array:
        points, places = values[: 3 * count].reshape(count, 3), values[3 * count :].reshape(seen, 3)
        at = origin + np.einsum("mij,mj->mi", turn, points[poses.point])
        return np.asarray(np.linalg.norm(at - places[poses.station], axis=1) - poses.distance)

    start = np.concatenate([np.zeros(3 * count), stations.ravel()])
    values = least_squares(misses, start, loss="soft_l1", f_scale=10.0 * LEAST).x
    tool = values[: 3 * count].reshape(count, 3)
    return replace(state, tool=tool[0] if count == 1 else tool, stations=values[3 * count :].reshape(seen, 3))


def _trilaterated(points: Array, distance: Array) -> Array:
    """Return the place (3,) that has these distances (m,) from points (m, 3), by linear least squares.

    |p|² − l² = 2 p·c − |c|², whose last term is taken as a fourth unknown.

    Raises
    ------
    ValueError
        Where the points lie in one plane, behind which a station has its mirror image.
    """
    centre = points.mean(axis=0)
    apart = points - centre
    across = np.linalg.svd(apart, compute_uv=False)[2] / np.sqrt(len(points))
    if across < LEAST:
        raise ValueError("the joints move the point in one plane at most, expected three directions")
    design = np.column_stack([2.0 * apart, -np.ones(len(points))])
    square = np.sum(apart**2, axis=1) - distance**2
    return np.asarray(centre + np.linalg.lstsq(design, square, rcond=None)[0][:3])


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
