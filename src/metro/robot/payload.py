"""Gravity of a mass on the flange."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from metro.robot.kinematics import Arm
from metro.robot.statics import Flange, joint_torque, tip_jacobian_of
from metro.units import Array

GRAVITY = 9.81  # m/s², along −z of the base


@dataclass(frozen=True)
class Payload:
    """A mass, kg, and its centre in the flange frame, m."""

    mass: float = 0.0
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)


def gravity_torque(arm: Arm, flange: Flange, payload: Payload) -> Array:
    """Torque of the motors (m, n), N m, that holds a payload: that of its weight at its centre.

    ``flange`` along m points. The base stands upright.
    """
    at_centre = tip_jacobian_of(replace(arm, tool=np.array(payload.centre)), flange)
    weight = arm.work[:3, :3].T @ np.array([0.0, 0.0, -payload.mass * GRAVITY])
    return joint_torque(at_centre, np.broadcast_to(weight, (len(at_centre), 3)))
