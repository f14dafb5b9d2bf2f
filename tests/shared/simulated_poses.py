"""An arm under a tracker, simulated by composed rotations: none of the code that is tested takes part."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

# An arm with two parallel axes, its lengths those of no robot here: θ₀, α (deg), d, a (m)
ROWS = np.array(
    [
        [0.0, -90.0, 0.42, 0.16],
        [-90.0, 0.0, 0.0, 0.71],
        [0.0, -90.0, 0.0, 0.11],
        [0.0, 90.0, 0.68, 0.0],
        [0.0, -90.0, 0.0, 0.05],
        [20.0, 0.0, 0.12, 0.0],
    ]
)
TOOL = np.array([0.09, -0.05, 0.11])
TRACKER, PLACE = Rotation.from_euler("xyz", [0.02, -0.03, 1.1]), np.array([2.3, -1.4, 0.3])
REACH = np.array([2.4, 1.0, 1.0, 2.6, 1.7, 2.8])
MASSES = np.array([0.0, 14.0, 11.0, 4.0, 2.0, 1.5])  # kg
CENTRES = 0.4  # part of the way back to the joint before
COMPLIANCE = np.array([0.0, 4.0e-6, 6.0e-6, 0.0, 0.0, 0.0])  # rad/(N m)


def frames(rows, q):
    """Return rotations and origins of the frame after each joint, of one pose, the base first."""
    turn, origin = Rotation.identity(), np.zeros(3)
    found = [(turn, origin)]
    for (theta, alpha, d, a), angle in zip(rows, q, strict=True):
        about_z = turn * Rotation.from_euler("z", theta + angle)
        origin = origin + turn.apply([0.0, 0.0, d]) + about_z.apply([a, 0.0, 0.0])
        turn = about_z * Rotation.from_euler("x", alpha)
        found.append((turn, origin))
    return found


def gravity_torques(rows, q):
    """Return the torque of the bodies' weights about each joint's axis, N m, base upright."""
    at = frames(rows, q)
    centres = [CENTRES * at[k][1] + (1 - CENTRES) * at[k + 1][1] for k in range(6)]
    torques = []
    for joint in range(6):
        axis, origin = at[joint][0].apply([0.0, 0.0, 1.0]), at[joint][1]
        weights = [np.cross(centres[k] - origin, [0.0, 0.0, -9.81 * MASSES[k]]) for k in range(joint, 6)]
        torques.append(float(np.sum(weights, axis=0) @ axis))
    return np.array(torques)


def measured(q, errors=None, turned=lambda _joint, angle: 0.0 * angle, *, sags=False, sigma=0.0, seed=0):
    """Return positions (m, 3), m, in the frame of a tracker.

    ``errors``: (6, 4) of the rows, rad and m. ``turned(joint, angle)``: what a joint turns by beyond its
    reading, rad.
    """
    rows = ROWS * (np.pi / 180, np.pi / 180, 1.0, 1.0) + (0.0 if errors is None else errors)
    points = []
    for pose in q:
        angles = pose + [turned(joint, angle) for joint, angle in enumerate(pose)]
        if sags:
            angles = angles + COMPLIANCE * gravity_torques(rows, pose)
        turn, origin = frames(rows, angles)[-1]
        points.append(TRACKER.apply(origin + turn.apply(TOOL)) + PLACE)
    return np.array(points) + sigma * np.random.default_rng(seed).standard_normal((len(q), 3))


def drawn(count, seed=0):
    """Draw joint angles (count, 6), rad."""
    return np.random.default_rng(seed).uniform(-REACH, REACH, (count, 6))


def rows_rad():
    """Return the nominal rows, rad and m."""
    return ROWS * (np.pi / 180, np.pi / 180, 1.0, 1.0)
