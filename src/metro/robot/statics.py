"""Static forces and deflections of an arm whose joints are the springs (physics.md §4).

A force on the tip acts on the flange as the wrench W f, with W = [I; [p]×] and p from the flange to the tip;
the same W turned over gives what the tip moves when the flange does: δ_tip = Wᵀ δ_flange.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.robot.kinematics import Arm, Geometry, forward, jacobian
from metro.units import Array

ROUNDING = 1e-12  # m/rad


def wrench_map(lever: Array) -> Array:
    """W = [I; [p]×], (..., 6, 3): the wrench at the flange of a unit force at the end of ``lever`` (..., 3).

    From geometry, in whatever frame the lever is given. (Printed eq. 13 of [K] exchanges two rows' lever
    arms.)
    """
    x, y, z = np.moveaxis(lever, -1, 0)
    zero = 0 * x
    cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]])
    identity = np.broadcast_to(np.eye(3), (*lever.shape[:-1], 3, 3))
    return np.concatenate([identity, np.moveaxis(cross, (0, 1), (-2, -1))], axis=-2)


@dataclass(frozen=True, eq=False)
class Flange:
    """The flange along a path: ``axes`` (..., 3, 3) and ``jacobian`` (..., 6, n), both in the base frame."""

    axes: Array
    jacobian: Array


def flange_of(dh: Geometry, q: Array) -> Flange:
    """Return the flange of an arm for joint angles ``q`` (..., n) in rad."""
    return Flange(forward(dh, q)[..., :3, :3], jacobian(dh, q))


def tip_jacobian(arm: Arm, q: Array) -> Array:
    """Tip velocity in the work frame per joint rate, (..., 3, n), for ``q`` (..., n) in rad."""
    return tip_jacobian_of(arm, flange_of(arm.dh, q))


def driven_jacobian(arm: Arm, q: Array) -> Array:
    """Jacobian of the tip (..., 3, k) of the k joints whose torques are evaluated: those that turn."""
    return tip_jacobian(arm, q)[..., arm.axes.turning]


def tip_jacobian_of(arm: Arm, flange: Flange) -> Array:
    """Tip velocity in the work frame per joint rate, (..., 3, n), of an arm whose flange is known."""
    lever = flange.axes @ arm.tool
    in_base = np.swapaxes(wrench_map(lever), -1, -2) @ flange.jacobian
    return np.asarray(arm.work[:3, :3].T @ in_base)


def joint_torque(jacobian_at_tip: Array, force: Array) -> Array:
    """Rise of the motor torques, N m, (..., n), that a force on the tip (..., 3) asks for: τ = −Jᵀ f.

    The motors carry the reaction: a force that pushes the tool is seen with the opposite sign.
    """
    return np.asarray(-np.einsum("...ai,...a->...i", jacobian_at_tip, force))


def moving_jacobian(arm: Arm, q: Array, flange_rotation: float = 1.0) -> Array:
    """Where a turn of each joint takes the tip, work frame, m/rad, (..., 3, n).

    ``flange_rotation``: how much of the flange's rotation counts; 1 is the truth, 0 moves the tip as the
    flange's origin is moved ([K] eq. 16 without its turn).
    """
    return moving_jacobian_of(arm, flange_of(arm.dh, q), flange_rotation)


def moving_jacobian_of(arm: Arm, flange: Flange, flange_rotation: float) -> Array:
    """Where a turn of each joint takes the tip, (..., 3, n), as above, of an arm whose flange is known."""
    at_tip = tip_jacobian_of(arm, flange)
    if flange_rotation == 1.0:
        return at_tip
    at_flange = arm.work[:3, :3].T @ flange.jacobian[..., :3, :]
    moved = at_flange + flange_rotation * (at_tip - at_flange)
    # the last joint does not move the flange's origin: what rounding leaves must not pass for a lever
    return np.where(np.abs(moved) > ROUNDING, moved, 0.0)


def joint_contributions(arm: Arm, q: Array, force: Array, *, flange_rotation: float = 1.0) -> Array:
    """Return what each joint adds to the deflection of the tip under a force there, per unit of compliance.

    The deflection is this times the compliances: δ = Σ_i c_i j_i (j_iᵀ f), j_i the columns of the tip's
    Jacobian.

    Parameters
    ----------
    q : (..., n) rad. force : (..., 3) N, work frame.
    flange_rotation : as of :func:`moving_jacobian`.

    Returns
    -------
    Array
        (..., 3, n), work frame, m per rad/(N m).
    """
    torque = -joint_torque(tip_jacobian(arm, q), force)
    return moving_jacobian(arm, q, flange_rotation) * torque[..., None, :]


def deflections(arm: Arm, q: Array, twist: Array) -> tuple[Array, Array, Array]:
    """Return where joints that are twisted take flange and tip ([K] eq. 16 to 18), each (..., 3), work frame.

    Parameters
    ----------
    q, twist : (..., n) rad.

    Returns
    -------
    tuple
        displacement of the flange, m; its rotation, rad; displacement of the tip, m: that of the flange and
        ω × p.
    """
    in_work = arm.work[:3, :3].T
    moved = in_work @ jacobian(arm.dh, q).reshape(*np.shape(q)[:-1], 2, 3, np.shape(q)[-1])
    flange, turned = np.moveaxis(np.einsum("...cai,...i->...ca", moved, twist), -2, 0)
    return flange, turned, flange + np.cross(turned, arm.lever(q) @ arm.work[:3, :3])


def tip_compliance(arm: Arm, q: Array, compliance: Array, *, flange_rotation: float = 1.0) -> Array:
    """Compliance of the tip, m/N, (..., 3, 3), work frame, from joint compliances (n,) in rad/(N m).

    Symmetric with ``flange_rotation``: C = Wᵀ J diag(c) Jᵀ W.
    """
    unit_forces = np.eye(3)
    spread = np.asarray(q)[..., None, :]
    columns = joint_contributions(arm, spread, unit_forces, flange_rotation=flange_rotation) @ compliance
    return np.swapaxes(columns, -1, -2)
