"""A six-axis arm: forward and inverse kinematics, tip Jacobian, gravity, compliance of the joints.

Standard Denavit-Hartenberg; everything is expressed at the tool's tip and in the base frame, so that a force
on the tip loads joint i with the i-th column of the tip Jacobian.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.units import DEG, MM, Array

_GRAVITY = 9.81


@dataclass(frozen=True)
class Arm:
    """An arm with its tool.

    Attributes
    ----------
    dh : (6, 4) rows θ₀ (deg), α (deg), d (mm), a (mm). tip : (3,) in the flange frame, m.
    tool_axes : (3, 3), columns are the tool's axes in the flange frame.
    stiffness : (6,) of the joints, N m/rad. masses : (6,) carried at the origin of each link's frame, kg.
    """

    dh: Array
    tip: Array
    tool_axes: Array
    stiffness: Array
    masses: Array

    def frames(self, q: Array) -> Array:
        """Return the frames (7, 4, 4) of base, links and flange at joint angles ``q`` (6,), rad."""
        frames = [np.eye(4)]
        for (theta, alpha, d, a), angle in zip(self.dh, q, strict=True):
            turn, twist = theta * DEG + angle, alpha * DEG
            screw_z = _screw(2, turn, d * MM)
            screw_x = _screw(0, twist, a * MM)
            frames.append(frames[-1] @ screw_z @ screw_x)
        return np.array(frames)

    def pose(self, q: Array) -> tuple[Array, Array]:
        """Return position (3,), m, and axes (3, 3) of the tool in the base frame."""
        flange = self.frames(q)[6]
        return flange[:3, :3] @ self.tip + flange[:3, 3], flange[:3, :3] @ self.tool_axes

    def jacobian(self, q: Array) -> Array:
        """Return (6, 6): velocity and angular velocity of the tip in the base frame per joint speed."""
        frames = self.frames(q)
        tip = frames[6, :3, :3] @ self.tip + frames[6, :3, 3]
        axes = frames[:6, :3, 2]
        return np.vstack([np.cross(axes, tip - frames[:6, :3, 3]).T, axes.T])

    def gravity(self, q: Array) -> Array:
        """Return the torques (6,), N m, that hold the links' masses."""
        frames = self.frames(q)
        torque = np.zeros(6)
        for link, mass in enumerate(self.masses, start=1):
            lever = frames[link, :3, 3] - frames[:link, :3, 3]
            torque[:link] += mass * _GRAVITY * np.cross(frames[:link, :3, 2], lever)[:, 2]
        return torque

    def yields(self, q: Array, force: Array) -> Array:
        """Return the displacement (3,), m, of the tip under a force (3,), N, both in the base frame."""
        linear = self.jacobian(q)[:3]
        moved: Array = linear @ ((linear.T @ force) / self.stiffness)
        return moved

    def reach(self, position: Array, axes: Array, start: Array) -> Array:
        """Joint angles (6,), rad, that bring the tool to a pose, from those of a pose nearby.

        Raises
        ------
        RuntimeError
            Where Newton's method finds none.
        """
        q = np.array(start, dtype=float)
        for _ in range(100):
            at, turned = self.pose(q)
            error = np.concatenate([position - at, _rotation(axes @ turned.T)])
            if np.abs(error).max() < 1e-11:
                return q
            q = q + np.clip(np.linalg.solve(self.jacobian(q), error), -0.2, 0.2)
        raise RuntimeError(f"the arm does not reach {position} m (rest {np.abs(error).max():.1e})")

    def follow(self, positions: Array, axes: Array, start: Array) -> Array:
        """Joint angles (n, 6), rad, along tip positions (n, 3), m, with one orientation of the tool."""
        angles = []
        for position in positions:
            start = self.reach(position, axes, start)
            angles.append(start)
        return np.array(angles)


def _screw(axis: int, angle: float, shift: float) -> Array:
    """Turn about a coordinate axis and move along it."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    screw = np.eye(4)
    screw[i, i] = screw[j, j] = math.cos(angle)
    screw[i, j], screw[j, i] = -math.sin(angle), math.sin(angle)
    screw[axis, 3] = shift
    return screw


def _rotation(turn: Array) -> Array:
    """Rotation vector (3,), rad, of a small rotation matrix; shortened for a large one, same axis."""
    return 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])


def rotation_rpy(roll: float, pitch: float, yaw: float) -> Array:
    """Return R_z(yaw) R_y(pitch) R_x(roll), angles in rad."""
    turned: Array = (_screw(2, yaw, 0.0) @ _screw(1, pitch, 0.0) @ _screw(0, roll, 0.0))[:3, :3]
    return turned
