"""What a measurement sees of a point: its three coordinates, or its distance from a station alone."""

from __future__ import annotations

import numpy as np

from metro.robot.calibration.model import BASE, State
from metro.robot.calibration.poses import Poses
from metro.units import Array


def lines(state: State, at: Array, poses: Poses) -> Array:
    """Return the unit vectors (m, 3) from each row's station to where a model has its point, ``at``."""
    apart = at - state.stations[poses.station]
    return np.asarray(apart / np.linalg.norm(apart, axis=1, keepdims=True))


def residuals(state: State, at: Array, poses: Poses) -> Array:
    """Return measured less predicted, m: (m, 3) of positions, (m, 1) of distances."""
    if not poses.by_distance:
        return np.asarray(poses.at - at)
    apart = np.linalg.norm(at - state.stations[poses.station], axis=1)
    return np.asarray((poses.distance - apart)[:, None])


def seen(state: State, at: Array, poses: Poses, moves: Array) -> Array:
    """Return what is seen, (m, d, k), of how parameters move the point, ``moves`` (m, 3, k).

    d is 3 of positions and 1 of distances.
    """
    return np.einsum("mi,mik->mk", lines(state, at, poses), moves)[:, None] if poses.by_distance else moves


def seen_of_geometry(state: State, at: Array, poses: Poses, derivatives: Array) -> Array:
    """Return what is seen, (m, d, head + 5 n), of the parameters of a geometry, those of stations, too.

    ``derivatives``: (m, 3, head + 5 n) of :func:`metro.robot.calibration.model.jacobian`.
    """
    found = seen(state, at, poses, derivatives)
    if not poses.by_distance:
        return found
    found, first, towards = found.copy(), len(BASE) + state.tool.size, -lines(state, at, poses)
    for station in range(len(state.stations)):
        own = poses.station == station
        found[own, 0, first + 3 * station : first + 3 * station + 3] = towards[own]
    return found
