"""How well an arm moves and pushes in all directions: manipulability, condition number, singular poses.

A Jacobian mixes m and rad; a characteristic length L makes them comparable: rotations count as L times rad
(Angeles, Fundamentals of Robotic Mechanical Systems, 2014, §5.8).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array


@dataclass(frozen=True, eq=False)
class Conditioning:
    """Conditioning of Jacobians (...).

    Attributes
    ----------
    manipulability : (...) √det(J Jᵀ) of the Jacobian in m (Yoshikawa, Int. J. Robotics Research 4, 1985).
    condition : (...) largest over smallest singular value; infinite in a singular pose.
    weakest : (..., 6) unit vector of task velocities (m, L rad) that the joints can hardly make.
    weakest_gain : (...) m per rad of joint motion in that direction.
    """

    manipulability: Array
    condition: Array
    weakest: Array
    weakest_gain: Array


def conditioning(jacobian: Array, length: float) -> Conditioning:
    """Conditioning of geometric Jacobians (..., 6, n): three rows of velocity, three of angular velocity.

    Parameters
    ----------
    length : characteristic length, m: :func:`characteristic_length`, or the lever that the process acts on.
    """
    scaled = jacobian * np.repeat([1.0, length], 3)[:, None]
    # eigenvalues of J Jᵀ halve the digits: singular values below 1e-8 of the largest would be lost
    directions, gains, _ = np.linalg.svd(scaled, full_matrices=False)
    least = gains[..., -1]
    condition = np.full_like(least, np.inf)
    np.divide(gains[..., 0], least, out=condition, where=least > np.finfo(float).eps * gains[..., 0])
    return Conditioning(np.prod(gains, axis=-1), condition, directions[..., -1], least)


def characteristic_length(jacobian: Array) -> float:
    """Length (m) that gives the mean rotation per joint rate the weight of the mean translation.

    √(Σ|J_v|² / Σ|J_ω|²) over all poses of ``jacobian`` (..., 6, n).
    """
    return float(np.linalg.norm(jacobian[..., :3, :]) / np.linalg.norm(jacobian[..., 3:, :]))
