"""The mass of the links of an arm as the tip feels it when the joints yield to a force there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from virtual_cell.arm import Arm
from virtual_cell.units import Array


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
