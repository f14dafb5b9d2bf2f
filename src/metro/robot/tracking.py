"""How far an arm is off its set-points, flange and tip, in position and posture ([K] eqs. 3–4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.robot.kinematics import Arm, forward
from metro.units import Array


@dataclass(frozen=True, eq=False)
class TrackingError:
    """Measured less commanded pose, work frame.

    Attributes
    ----------
    flange, tip : (..., 3) of the position, m. rotation : (..., 3) rotation vector that turns the commanded
        posture into the measured one, rad; flange and tip share it.
    """

    flange: Array
    tip: Array
    rotation: Array


def tracking_error(arm: Arm, measured: Array, commanded: Array) -> TrackingError:
    """Pose error of flange and tip for joint angles (..., n), rad.

    A posture error φ at the flange moves the tip by φ × p more, p from the flange to the tip, to first order.
    """
    found, wanted = forward(arm.dh, measured), forward(arm.dh, commanded)
    shift = found[..., :3, 3] - wanted[..., :3, 3]
    lever = (found - wanted)[..., :3, :3] @ arm.tool
    turn = found[..., :3, :3] @ np.swapaxes(wanted[..., :3, :3], -1, -2)
    to_work = arm.work[:3, :3]
    return TrackingError(shift @ to_work, (shift + lever) @ to_work, rotation_vector(turn) @ to_work)


def rotation_vector(turn: Array) -> Array:
    """Axis times angle (rad, 0 … π) of rotation matrices (..., 3, 3), as (..., 3).

    From the unit quaternion, whose largest entry is at least a half, so that it is exact for small angles and
    for half turns alike (Shepperd, J. Guidance and Control 1, 1978).
    """
    trace = np.trace(turn, axis1=-2, axis2=-1)
    diagonal = np.moveaxis(np.diagonal(turn, axis1=-2, axis2=-1), -1, 0)
    squares = np.stack([1 + trace, *(1 - trace + 2 * diagonal)], axis=-1)  # 4 w², 4 x², 4 y², 4 z²
    r = np.moveaxis(turn, (-2, -1), (0, 1))
    products = np.array(  # 4 times the products of w, x, y, z
        [
            [squares[..., 0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], squares[..., 1], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
            [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], squares[..., 2], r[1, 2] + r[2, 1]],
            [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], squares[..., 3]],
        ]
    )
    largest = np.argmax(squares, axis=-1)
    row = np.take_along_axis(np.moveaxis(products, (0, 1), (-2, -1)), largest[..., None, None], axis=-2)
    quaternion = row[..., 0, :] / np.linalg.norm(row[..., 0, :], axis=-1, keepdims=True)
    quaternion = quaternion * np.where(quaternion[..., :1] < 0, -1.0, 1.0)
    vector = quaternion[..., 1:]
    sine = np.linalg.norm(vector, axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, quaternion[..., :1])
    factor = np.divide(angle, sine, out=np.full_like(sine, 2.0), where=sine > 0)
    return np.asarray(vector * factor)
