"""How stiff the tip of an arm is over its workspace: Cartesian stiffness, its ellipsoid, and maps of both.

K_c = (J K_θ⁻¹ Jᵀ)⁻¹ at the tip, from joints that give way and links that do not (physics.md §4).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.robot.kinematics import Arm, forward, jacobian
from metro.robot.statics import tip_compliance, tip_jacobian, wrench_map
from metro.units import UM, Array

STRIDES = 12  # straight steps from the known pose to each place: the elbow stays on its side
POLISH = 8
REACHED = 1 * UM
ALIGNED = 1e-6  # rad
DAMPING = 1e-6  # of the largest singular value, squared: keeps a step through a singular pose finite


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """Stiffness of the tip in places (...).

    Attributes
    ----------
    matrix : (..., 3, 3) N/m, work frame: force = matrix @ deflection.
    principal : (..., 3) N/m, from the softest axis to the stiffest.
    axes : (..., 3, 3) unit vectors of these in the columns.
    along : (..., 3) N/m, force over deflection in its own direction, for forces along x, y, z.
    """

    matrix: Array
    principal: Array
    axes: Array
    along: Array


@dataclass(frozen=True, eq=False)
class Map:
    """Stiffness over m places of the tip with the tool held as in a known pose.

    Attributes
    ----------
    place : (m, 3) m, work frame. joints : (m, n) rad; NaN where the arm does not reach.
    stiffness : of the places; NaN where the arm does not reach.
    condition : (m,) of the tip's Jacobian (3 × n): large where a direction needs large joint speeds.
    """

    place: Array
    joints: Array
    stiffness: Ellipsoid
    condition: Array


def ellipsoid(arm: Arm, q: Array, compliance: Array) -> Ellipsoid:
    """Stiffness of the tip in poses ``q`` (..., n) rad from joint compliances (n,) rad/(N m)."""
    giving = tip_compliance(arm, q, compliance)
    giving = 0.5 * (giving + np.swapaxes(giving, -1, -2))
    values, axes = np.linalg.eigh(giving)
    principal = 1.0 / values[..., ::-1]
    axes = axes[..., ::-1]
    matrix = (axes * principal[..., None, :]) @ np.swapaxes(axes, -1, -2)
    return Ellipsoid(matrix, principal, axes, 1.0 / np.diagonal(giving, axis1=-2, axis2=-1))


def principal_sd(arm: Arm, q: Array, compliance: Array, covariance: Array) -> Array:
    """Return the standard errors (..., 3), N/m, of principal stiffnesses from those of the compliances.

    First order: an eigenvalue λ of C = Σ c_i j_i j_iᵀ changes with c_i by (vᵀ j_i)², its stiffness 1/λ by
    that over −λ².

    Parameters
    ----------
    covariance : (n, n) of the compliances, (rad/(N m))².
    """
    stiffness = ellipsoid(arm, q, compliance)
    gain = np.einsum("...ap,...ai->...pi", stiffness.axes, tip_jacobian(arm, q)) ** 2
    gain = gain * stiffness.principal[..., None] ** 2
    return np.asarray(np.sqrt(np.einsum("...pi,ij,...pj->...p", gain, covariance, gain)))


def reach(arm: Arm, start: Array, place: Array) -> Array:
    """Joint angles that bring the tip to places with the tool held as in a known pose.

    Newton's method with damping (Nakamura & Hanafusa 1986), along straight lines from the known pose, all
    places at once.

    Parameters
    ----------
    start : (n,) rad. place : (m, 3) m, work frame.

    Returns
    -------
    Array
        (m, n) rad; NaN where no pose was found within 1 µm and 1 µrad.
    """
    held = forward(arm.dh, start)[:3, :3]
    begin = arm.tip(start)
    q: Array = np.tile(start, (len(place), 1)).astype(float)
    for stride in range(1, STRIDES + POLISH + 1):
        target = begin + min(stride / STRIDES, 1.0) * (place - begin)
        moved, turned = _error(arm, q, target, held)
        q = q + _newton(arm, q, np.concatenate([moved, turned], axis=1))
    moved, turned = _error(arm, q, place, held)
    reached = (np.linalg.norm(moved, axis=1) < REACHED) & (np.linalg.norm(turned, axis=1) < ALIGNED)
    return np.where(reached[:, None], q, np.nan)


def stiffness_map(arm: Arm, start: Array, place: Array, compliance: Array) -> Map:
    """Stiffness over places (m, 3), m, work frame, with the tool held as in the pose ``start`` (n,) rad.

    ``compliance`` (n,) rad/(N m).
    """
    q = reach(arm, start, place)
    there = np.isfinite(q).all(axis=1)
    inside = ellipsoid(arm, q[there], compliance)

    def filled(values: Array) -> Array:
        out = np.full((len(place), *values.shape[1:]), np.nan)
        out[there] = values
        return out

    parts = (inside.matrix, inside.principal, inside.axes, inside.along)
    condition = np.linalg.cond(tip_jacobian(arm, q[there]))
    return Map(place, q, Ellipsoid(*(filled(part) for part in parts)), filled(condition))


def _error(arm: Arm, q: Array, target: Array, held: Array) -> tuple[Array, Array]:
    """Return what the tip still has to move and turn, (m, 3) m and rad, base frame."""
    turn = held @ np.swapaxes(forward(arm.dh, q)[:, :3, :3], 1, 2)
    sine = np.stack(
        [turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]]
    )
    return (target - arm.tip(q)) @ arm.work[:3, :3].T, 0.5 * sine.T


def _newton(arm: Arm, q: Array, error: Array) -> Array:
    """Damped step (m, n) of the joints towards an error (m, 6) of the tip, base frame."""
    at_flange = jacobian(arm.dh, q)
    at_tip = np.concatenate(
        [np.swapaxes(wrench_map(arm.lever(q)), 1, 2) @ at_flange, at_flange[:, 3:]], axis=1
    )
    square = at_tip @ np.swapaxes(at_tip, 1, 2)
    square = square + DAMPING * np.trace(square, axis1=1, axis2=2)[:, None, None] * np.eye(6)
    return np.asarray(np.einsum("mij,mi->mj", at_tip, np.linalg.solve(square, error[:, :, None])[:, :, 0]))
