"""Euler angles and quaternions of a rotation, as robot controllers state them.

Angles are those of ABB and of this project's ``rpy``: R = R_z(rz) R_y(ry) R_x(rx), which is Z-Y-X about the
turning axes and X-Y-Z about the fixed ones. Quaternions are (q1, q2, q3, q4) = (scalar, x, y, z), as ABB
writes them; q and −q are one rotation, and the scalar that is returned is not negative.
"""

from __future__ import annotations

import numpy as np

from metro.units import Array

LEVEL = 1e-12  # of cos(ry) squared: nearer to the poles rz and rx are not identifiable


def matrix_of_quaternion(quaternion: Array) -> Array:
    """Rotation matrices (..., 3, 3) of quaternions (..., 4), of any length but zero.

    Raises
    ------
    ValueError
        If a quaternion has no length.
    """
    size = np.linalg.norm(quaternion, axis=-1, keepdims=True)
    if not (size > 0.0).all():
        raise ValueError("a quaternion of length zero is no rotation")
    s, x, y, z = np.moveaxis(np.asarray(quaternion) / size, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - s * z), 2 * (x * z + s * y)],
        [2 * (x * y + s * z), 1 - 2 * (x * x + z * z), 2 * (y * z - s * x)],
        [2 * (x * z - s * y), 2 * (y * z + s * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def quaternion_of_matrix(turn: Array) -> Array:
    """Quaternions (..., 4) of rotation matrices (..., 3, 3).

    Of the four products of two components the largest is divided by, so that no digit is lost at half turns
    (Shepperd, J. Guid. Control 1 (1978) 223).
    """
    r = np.asarray(turn, dtype=float)
    xx, yy, zz = r[..., 0, 0], r[..., 1, 1], r[..., 2, 2]
    a, b, c = r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]
    d, e, f = r[..., 0, 1] + r[..., 1, 0], r[..., 0, 2] + r[..., 2, 0], r[..., 1, 2] + r[..., 2, 1]
    rows = [
        [1 + xx + yy + zz, a, b, c],
        [a, 1 + xx - yy - zz, d, e],
        [b, d, 1 - xx + yy - zz, f],
        [c, e, f, 1 - xx - yy + zz],
    ]
    products = np.moveaxis(np.array(rows), (0, 1), (-2, -1))  # 4 q qᵀ
    largest = np.argmax(np.diagonal(products, axis1=-2, axis2=-1), axis=-1)
    chosen = np.take_along_axis(products, largest[..., None, None], axis=-2)[..., 0, :]
    quaternion = chosen / np.linalg.norm(chosen, axis=-1, keepdims=True)
    return np.asarray(np.where(quaternion[..., :1] < 0.0, -quaternion, quaternion))


def euler_of_matrix(turn: Array) -> Array:
    """Angles (..., 3) rx, ry, rz in rad of rotation matrices; rx is 0 where ry is a right angle.

    ry is within ±π/2, so that the angles are unique but at its ends.
    """
    r = np.asarray(turn, dtype=float)
    level = np.hypot(r[..., 0, 0], r[..., 1, 0])
    pole = level**2 < LEVEL
    rx = np.where(pole, 0.0, np.arctan2(r[..., 2, 1], r[..., 2, 2]))
    rz = np.where(pole, np.arctan2(-r[..., 0, 1], r[..., 1, 1]), np.arctan2(r[..., 1, 0], r[..., 0, 0]))
    return np.stack([rx, np.arctan2(-r[..., 2, 0], level), rz], axis=-1)


def matrix_of_euler(angles: Array) -> Array:
    """Rotation matrices (..., 3, 3) of angles (..., 3) rx, ry, rz in rad."""
    half = 0.5 * np.asarray(angles)
    (cx, cy, cz), (sx, sy, sz) = np.moveaxis(np.cos(half), -1, 0), np.moveaxis(np.sin(half), -1, 0)
    quaternion = [
        cz * cy * cx + sz * sy * sx,
        cz * cy * sx - sz * sy * cx,
        cz * sy * cx + sz * cy * sx,
        sz * cy * cx - cz * sy * sx,
    ]
    return matrix_of_quaternion(np.stack(quaternion, axis=-1))


def quaternion_of_euler(angles: Array) -> Array:
    """Quaternions (..., 4) of angles (..., 3) rx, ry, rz in rad."""
    return quaternion_of_matrix(matrix_of_euler(angles))


def euler_of_quaternion(quaternion: Array) -> Array:
    """Angles (..., 3) rx, ry, rz in rad of quaternions (..., 4)."""
    return euler_of_matrix(matrix_of_quaternion(quaternion))
