"""Joint torques of a serial arm of rigid links, as a linear function of the links' masses and inertias.

The torque of joint j is that of the wrenches that move the links beyond it, and each link's wrench is
linear in ten parameters: m, m c (3), and the inertia about the link frame's origin xx, xy, xz, yy, yz, zz
(Khalil & Dombre, Modeling, Identification and Control of Robots, 2002, ch. 9).
"""

from __future__ import annotations

import numpy as np

from metro.robot.kinematics import Geometry, link_frames, prismatic
from metro.units import Array

GRAVITY = 9.81
PARAMETERS = 10


def torque_regressor(dh: Geometry, q: Array, rate: Array, acceleration: Array) -> Array:
    """Matrix Y of τ = Y π, with π the ten parameters of link 1, of link 2, and so on.

    Parameters
    ----------
    dh : (n, 4) θ₀, α (rad), d, a (m), or a chain; gravity points along −z of the base.
    q, rate, acceleration : (m, n) rad, rad/s, rad/s².

    Returns
    -------
    Array
        (m, n, 10 n), N m (N of a linear axis) per unit of parameter. Torques do not identify all of them.
    """
    frames = link_frames(dh, q)
    axis, origin, turn = frames[:, :-1, :3, 2], frames[:, :, :3, 3], frames[:, 1:, :3, :3]
    moments = np.zeros((*q.shape, len(dh), PARAMETERS))
    omega, alpha = np.zeros((len(q), 3)), np.zeros((len(q), 3))
    lifted = np.tile([0.0, 0.0, GRAVITY], (len(q), 1))  # acceleration of the origin less that of gravity
    shifts = prismatic(dh)
    for i in range(len(dh)):
        about, speed, rise = axis[:, i], rate[:, i, None], acceleration[:, i, None]
        arm = origin[:, i + 1] - origin[:, i]
        if shifts[i]:
            lifted = lifted + about * rise + 2.0 * np.cross(omega, about * speed)
        else:
            alpha = alpha + about * rise + np.cross(omega, about * speed)
            omega = omega + about * speed
        lifted = lifted + np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))
        in_link = [np.einsum("mij,mi->mj", turn[:, i], vector) for vector in (omega, alpha, lifted)]
        force, couple = (turn[:, i] @ part for part in _wrench(*in_link))
        for j in range(i + 1):
            if shifts[j]:
                moments[:, j, i] = np.einsum("ma,mak->mk", axis[:, j], force)
                continue
            across = np.cross(axis[:, j], origin[:, i + 1] - origin[:, j])
            moments[:, j, i] = np.einsum("ma,mak->mk", axis[:, j], couple) + np.einsum(
                "ma,mak->mk", across, force
            )
    return moments.reshape(*q.shape, -1)


def gravity_regressor(dh: Geometry, q: Array) -> Array:
    """Return the torque regressor of an arm at rest, (m, n, 4 n): m and m c of each link."""
    still = np.zeros_like(q)
    by_link = torque_regressor(dh, q, still, still).reshape(*q.shape, -1, PARAMETERS)
    return by_link[..., :4].reshape(*q.shape, -1)


def _wrench(omega: Array, alpha: Array, lifted: Array) -> tuple[Array, Array]:
    """Force and couple (m, 3, 10) at a link frame's origin, its own axes, per unit of parameter."""
    spin, twist = _cross(omega), _cross(alpha)
    force = np.zeros((len(omega), 3, PARAMETERS))
    couple = np.zeros_like(force)
    force[:, :, 0] = lifted
    force[:, :, 1:4] = twist + spin @ spin
    couple[:, :, 1:4] = -_cross(lifted)
    couple[:, :, 4:] = _inertia_of(alpha) + spin @ _inertia_of(omega)
    return force, couple


def _cross(vector: Array) -> Array:
    """[v]×, (m, 3, 3)."""
    x, y, z = vector.T
    zero = 0 * x
    return np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), -1, 0)


def _inertia_of(vector: Array) -> Array:
    """Return L of I v = L (xx, xy, xz, yy, yz, zz), (m, 3, 6)."""
    x, y, z = vector.T
    zero = 0 * x
    rows = [[x, y, z, zero, zero, zero], [zero, x, zero, y, z, zero], [zero, zero, x, zero, y, z]]
    return np.moveaxis(np.array(rows), -1, 0)
