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
    from scipy.spatial.transform import Rotation

    actual, wanted = forward(arm.dh, measured), forward(arm.dh, commanded)
    shift = actual[..., :3, 3] - wanted[..., :3, 3]
    lever = (actual - wanted)[..., :3, :3] @ arm.tool
    turn = actual[..., :3, :3] @ np.swapaxes(wanted[..., :3, :3], -1, -2)
    angles = Rotation.from_matrix(turn.reshape(-1, 3, 3)).as_rotvec().reshape(shift.shape)
    to_work = arm.work[:3, :3]
    return TrackingError(shift @ to_work, (shift + lever) @ to_work, angles @ to_work)
