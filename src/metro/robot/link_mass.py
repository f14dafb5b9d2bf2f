"""The mass that an arm's links have at the tip, from their masses and centres of gravity.

The kinetic energy of the links, ½ q̇ᵀ M(q) q̇, is that of a mass matrix at the tip, ½ ẋᵀ M_r ẋ, once it is said
how the joints move when the tip does. [F] eq. 4 is another quantity, see :func:`mass_about_base`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from metro.robot.kinematics import Arm, Geometry, link_frames, prismatic
from metro.robot.statics import tip_jacobian
from metro.units import JSON, MM, Array

ROUNDING = 1e-9  # least eigenvalue of a joint mass matrix over its greatest, from which on it has an inverse


@dataclass(frozen=True, eq=False)
class Link:
    """A rigid body that moves with one joint.

    Attributes
    ----------
    joint : 1 for the body that the first joint moves, and so on; its frame is the one after that joint.
    mass : kg. centre : (3,) m, centre of gravity in that frame.
    inertia : (3, 3) kg m² about the centre, along that frame's axes; zero for a point mass.
    """

    joint: int
    mass: float
    centre: Array
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))


def links_of_cell(cell: JSON) -> tuple[Link, ...]:
    """Return the bodies of the contract's cell, ``arm.links`` and ``arm.head``; none without links."""
    arm = cell.get("arm") or {}
    links = list(enumerate(arm.get("links") or [], start=1))
    if not links:
        return ()
    head = arm.get("head")
    bodies = [*links, (len(links), head)] if head else links
    return tuple(_link(joint, body) for joint, body in bodies)


def _link(joint: int, body: JSON) -> Link:
    xx, yy, zz, xy, xz, yz = body.get("inertia_kg_m2") or (0.0,) * 6
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return Link(joint, float(body["mass_kg"]), np.asarray(body["centre_mm"], dtype=float) * MM, inertia)


def centres(dh: Geometry, q: Array, links: Sequence[Link]) -> Array:
    """Centres of gravity of the links in the base frame, (m, len(links), 3) m, at ``q`` (m, n) rad."""
    frames = link_frames(dh, q)
    parts = [frames[:, b.joint, :3, :3] @ b.centre + frames[:, b.joint, :3, 3] for b in links]
    return np.stack(parts, axis=1)


def joint_mass(dh: Geometry, q: Array, links: Sequence[Link]) -> Array:
    """Mass matrix M(q) of the joints, (m, n, n) kg m²: the links have the kinetic energy ½ q̇ᵀ M(q) q̇.

    Parameters
    ----------
    dh : (n, 4) θ₀, α (rad), d, a (m). q : (m, n) rad.
    """
    frames, at = link_frames(dh, q), centres(dh, q, links)
    axes, origins = frames[:, :-1, :3, 2], frames[:, :-1, :3, 3]
    total, shifts = np.zeros((len(q), len(dh), len(dh))), prismatic(dh)[:, None]
    for place, body in enumerate(links):
        moved = np.arange(len(dh)) < body.joint
        turn = np.where(moved[:, None], axes, 0.0)
        shift = np.cross(turn, at[:, place, None] - origins)
        shift = np.where(shifts, turn, shift)
        turn = np.where(shifts, 0.0, turn)
        own = frames[:, body.joint, :3, :3]
        inertia = own @ body.inertia @ np.swapaxes(own, -1, -2)
        total += body.mass * shift @ np.swapaxes(shift, -1, -2)
        total += turn @ inertia @ np.swapaxes(turn, -1, -2)
    return total


def tip_mass(arm: Arm, q: Array, links: Sequence[Link], joint_compliance: Array | None = None) -> Array:
    """Mass matrix of the tip, work frame, (m, 3, 3) kg, at ``q`` (m, n) rad.

    Parameters
    ----------
    joint_compliance : (n,) rad/(N m). With it the joints move as they do under a static force on the tip
        (Guyan, AIAA Journal 3 (1965) 380), which is what a model M Ẍ + K X = F of the tip alone takes.
        Without, as the links let the tip be moved most easily (Khatib, IEEE J. Robot. Autom. 3 (1987) 43):
        the least mass that the tip can have.

    Raises
    ------
    ValueError
        If a joint moves no mass and its compliance is not known: the tip has no least mass then.
    """
    jacobian, mass = tip_jacobian(arm, q), joint_mass(arm.dh, q, links)
    across = np.swapaxes(jacobian, -1, -2)
    if joint_compliance is not None:
        yielding = joint_compliance[:, None] * across
        motion = yielding @ np.linalg.inv(jacobian @ yielding)
        return np.asarray(np.swapaxes(motion, -1, -2) @ mass @ motion)
    values = np.linalg.eigvalsh(mass)
    if (values[:, 0] <= ROUNDING * values[:, -1]).any():
        raise ValueError("a joint moves no mass: the least mass of the tip takes the inertia of every link")
    return np.asarray(np.linalg.inv(jacobian @ np.linalg.inv(mass) @ across))


def mass_about_base(arm: Arm, q: Array, links: Sequence[Link]) -> Array:
    """[F] eq. 4: the links' tensor of inertia about the base over the square of the tip's distance from it.

    Work frame axes, (m, 3, 3) kg, at ``q`` (m, n) rad; of the links the centres alone count. It has the unit
    of a mass, but is not the mass of a tip: of a point mass m at the tip itself it makes m (I − r rᵀ/r²),
    which has no mass along the line r from the base.
    """
    at = centres(arm.dh, q, links)
    masses = np.array([body.mass for body in links])
    tip = arm.work[:3, :3] @ arm.tip(q)[..., None] + arm.work[:3, 3, None]
    square = np.einsum("k,mka,mka->m", masses, at, at)[:, None, None] * np.eye(3)
    tensor = square - np.einsum("k,mka,mkb->mab", masses, at, at)
    turned = arm.work[:3, :3].T @ tensor @ arm.work[:3, :3]
    return np.asarray(turned / np.sum(tip**2, axis=1)[..., None])
