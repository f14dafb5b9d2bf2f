"""Joints at which an arm has its tip at given places, with the flange turned as given: inverse kinematics.

A serial arm reaches most places with several postures. The posture is that of where each search begins: of
the first place a pose that is known, of every other one the joints of the place before. Steps are those of
damped least squares (Wampler, IEEE Trans. Syst. Man Cybern. 16 (1986) 93), which go through singular
postures, and stop within rounding where the place can be reached.
"""

from __future__ import annotations

import numpy as np

from metro.robot.kinematics import Arm, forward, jacobian
from metro.units import Array

STEPS = 200
LONGEST = 0.2  # rad or m, of a step of any joint: a longer one may end in another posture
LEVER = 0.1  # m: a turn counts as what it moves at this distance
NEAR, UNTURNED = 1e-8, 1e-7  # m, rad: to which a place is reached
DAMPING = 1e-3  # m: where a place is missed by less, steps are next to undamped


class OutOfReachError(ValueError):
    """A place that the arm does not reach."""


def joints_at(arm: Arm, places: Array, turns: Array, start: Array) -> Array:
    """Return joints (m, n), rad (m of a linear axis), one place after the other.

    Parameters
    ----------
    places : (m, 3) of the tip in the work frame, m. turns : (m, 3, 3) axes of the flange in the work frame.
    start : (n,) joints from which the first place is sought.

    Raises
    ------
    OutOfReachError
        Where a place, counted from 1, is not reached.
    """
    found, q = [], np.asarray(start, dtype=float)
    for i, (place, turn) in enumerate(zip(places, turns, strict=True)):
        q, missed, turned = _reached(arm, place, turn, q)
        if missed > NEAR or turned > UNTURNED:
            raise OutOfReachError(
                f"target {i + 1}: the declared arm comes to {1e3 * missed:.3g} mm and {1e3 * turned:.3g} "
                "mrad of it at best from the joints before; check tool_in_flange_mm, work_in_base and the "
                "angles, or put points between that lead there"
            )
        found.append(q)
    return np.array(found)


def nearest_joints(arm: Arm, place: Array, turn: Array | None, known: Array) -> Array:
    """Return of known joints (k, n) those that bring the arm nearest to a place; its turn may be any."""
    far = np.linalg.norm(arm.tip(known) - place, axis=1)
    if turn is not None:
        far = far + LEVER * np.linalg.norm(_turned(turn, arm.flange_axes(known)), axis=1)
    return np.asarray(known[int(np.argmin(far))])


def _reached(arm: Arm, place: Array, turn: Array, q: Array) -> tuple[Array, float, float]:
    """Return joints near ``q``, and by how much they miss a place and a turn: m, rad."""
    for _ in range(STEPS):
        off, about = place - arm.tip(q), _turned(turn, arm.flange_axes(q)[None])[0]
        missed, turned = float(np.linalg.norm(off)), float(np.linalg.norm(about))
        if missed < NEAR and turned < UNTURNED:
            break
        rows = _moves(arm, q)
        wanted = np.concatenate([off, LEVER * about])
        damping = min(DAMPING, float(np.linalg.norm(wanted))) ** 2
        step = rows.T @ np.linalg.solve(rows @ rows.T + damping * np.eye(6), wanted)
        q = q + step * min(1.0, LONGEST / max(float(np.abs(step).max()), 1e-300))
    return q, missed, turned


def _moves(arm: Arm, q: Array) -> Array:
    """Return what the joints move the tip and turn the flange by in the work frame, (6, n), m."""
    linear, angular = np.split(jacobian(arm.dh, q), 2)
    lever = forward(arm.dh, q)[:3, :3] @ arm.tool
    turn = arm.work[:3, :3].T
    return np.vstack([turn @ (linear + np.cross(angular.T, lever).T), LEVER * (turn @ angular)])


def _turned(wanted: Array, axes: Array) -> Array:
    """Return the rotation vectors (k, 3), work frame, that turn axes (k, 3, 3) to those that are wanted."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(wanted @ np.swapaxes(axes, -1, -2)).as_rotvec())
