"""The poses to measure next: those that make the covariance of the geometry smallest (D-optimal).

Candidates lie where each joint has been, and move the point to where it has been; chosen one after the other,
each adds most to the determinant of the information (Fedorov, Theory of Optimal Experiments (1972)).
"""

from __future__ import annotations

import numpy as np

from metro.robot.calibration.fit import Fit
from metro.robot.calibration.measured import seen_of_geometry
from metro.robot.calibration.model import jacobian
from metro.robot.calibration.poses import Poses
from metro.units import Array

DRAWN, CHOSEN = 4000, 20


def next_poses(fit: Fit, poses: Poses, count: int = CHOSEN, seed: int = 0) -> tuple[Array, Array]:
    """Return joints (count, n) of the poses to measure next, in their order, and what each leaves.

    The second is (count,): the geometric mean of the standard errors of the geometry after the pose over
    that before the first.
    """
    free = int(fit.free.sum())
    q = _candidates(fit, poses, seed)
    shifts = _seen(fit, q)[..., fit.free]
    covariance = fit.covariance[:free, :free]
    before = np.linalg.slogdet(covariance)[1]
    noise = float(np.median(poses.sigma))
    variance = (fit.scale**2 + noise**2) * np.eye(shifts.shape[1])
    chosen: list[int] = []
    left: list[float] = []
    for _ in range(min(count, len(q))):
        carried = shifts @ covariance
        gains = np.linalg.slogdet(variance + carried @ np.swapaxes(shifts, 1, 2))[1]
        gains[chosen] = -np.inf
        best = int(np.argmax(gains))
        inner = variance + carried[best] @ shifts[best].T
        covariance = covariance - carried[best].T @ np.linalg.solve(inner, carried[best])
        chosen.append(best)
        left.append(float(np.exp(0.5 * (np.linalg.slogdet(covariance)[1] - before) / free)))
    return q[chosen], np.array(left)


def _seen(fit: Fit, q: Array) -> Array:
    """Return what is seen of the geometry at joints (k, n): (k, 3, p), or (k, s, p) from all s stations."""
    at, derivatives = jacobian(fit.state, q)
    if not len(fit.state.stations):
        return derivatives
    blank = np.zeros(len(q))
    from_each = [
        Poses(q, at, blank, blank, blank, q, distance=blank, station=np.full(len(q), station))
        for station in range(len(fit.state.stations))
    ]
    return np.concatenate([seen_of_geometry(fit.state, at, one, derivatives) for one in from_each], axis=1)


def _candidates(fit: Fit, poses: Poses, seed: int) -> Array:
    """Draw joints (k, n) within their ranges that move the point within the box that was measured."""
    low, high = poses.q.min(axis=0), poses.q.max(axis=0)
    drawn = np.random.default_rng(seed).uniform(low, high, (DRAWN, len(low)))
    at = fit.state.position(drawn)
    inside = np.all((at >= poses.at.min(axis=0)) & (at <= poses.at.max(axis=0)), axis=1)
    return np.asarray(drawn[inside])
