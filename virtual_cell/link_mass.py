"""What the masses of an arm's links do: the mass that the tip feels, and the torques that hold them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from virtual_cell.arm import Arm
from virtual_cell.units import Array

_GRAVITY = 9.81


@dataclass(frozen=True)
class Body:
    """``mass`` kg at ``centre`` (3,) m in the frame after ``joint`` (1 to 6)."""

    joint: int
    mass: float
    centre: tuple[float, float, float]


def tip_mass(arm: Arm, q: Array, bodies: tuple[Body, ...]) -> Array:
    """Mass matrix (3, 3), kg, base frame: a speed v of the tip has the kinetic energy ½ vᵀ M v of the bodies.

    The joints turn as a static force on the tip turns them.
    """
    frames, linear = arm.frames(q), arm.jacobian(q)[:3]
    forces = np.linalg.inv(np.column_stack([arm.yields(q, unit) for unit in np.eye(3)]))
    rates = (linear.T @ forces) / arm.stiffness[:, None]
    total = np.zeros((3, 3))
    for body in bodies:
        at = frames[body.joint, :3, :3] @ np.array(body.centre) + frames[body.joint, :3, 3]
        moved = np.zeros((3, 3))
        for joint in range(body.joint):
            lever = np.cross(frames[joint, :3, 2], at - frames[joint, :3, 3])
            moved += np.outer(lever, rates[joint])
        total += body.mass * moved.T @ moved
    return total


def holding(arm: Arm, q: Array, bodies: tuple[Body, ...]) -> Array:
    """Torques (6,), N m, of the motors that hold the bodies at rest."""
    frames, torque = arm.frames(q), np.zeros(6)
    for body in bodies:
        at = frames[body.joint, :3, :3] @ np.array(body.centre) + frames[body.joint, :3, 3]
        lever = at - frames[: body.joint, :3, 3]
        torque[: body.joint] += body.mass * _GRAVITY * np.cross(frames[: body.joint, :3, 2], lever)[:, 2]
    return torque
