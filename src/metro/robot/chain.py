"""A serial chain of joints of any convention: standard and modified Denavit–Hartenberg rows, URDF joints.

Every convention is a row of fixed motions with a turn about, or a shift along, one axis between them. They
are put together anew so that the frame after joint i has joint i + 1's axis as its z, as in the standard
convention: whatever is computed from frames is the same for all.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from metro.units import DEG, JSON, MM, Array

REVOLUTE, PRISMATIC, FIXED = "revolute", "prismatic", "fixed"


@dataclass(frozen=True, eq=False)
class Chain:
    """A chain of n joints.

    Attributes
    ----------
    first : (4, 4) frame in the base whose z is the first joint's axis.
    after : (n, 4, 4) from the frame in which joint i has moved to the one whose z is the next joint's axis;
        the last is the flange.
    prismatic : (n,) bool, whether a joint shifts (m) along its axis instead of turning (rad) about it.
    """

    first: Array
    after: Array
    prismatic: np.ndarray

    def __len__(self) -> int:
        return len(self.after)

    def frames(self, q: Array) -> Array:
        """Frames after each joint in the base, the first axis' before them, (..., n + 1, 4, 4)."""
        c, s = np.cos(q), np.sin(q)
        frames = [np.broadcast_to(self.first, (*q.shape[:-1], 4, 4))]
        for i, shifts in enumerate(self.prismatic):
            step = np.broadcast_to(np.eye(4), (*q.shape[:-1], 4, 4)).copy()
            if shifts:
                step[..., 2, 3] = q[..., i]
            else:
                step[..., 0, 0] = step[..., 1, 1] = c[..., i]
                step[..., 0, 1], step[..., 1, 0] = -s[..., i], s[..., i]
            frames.append(frames[-1] @ step @ self.after[i])
        return np.stack(frames, axis=-3)


Motion = tuple[str, Array]  # fixed with its (4, 4), or a kind of joint with its axis (3,)


def chain(motions: Iterable[Motion]) -> Chain:
    """Return a chain from its motions, one after the other."""
    pending, parts, shifts = np.eye(4), [], []
    for kind, what in motions:
        if kind == FIXED:
            pending = pending @ what
            continue
        turn = np.eye(4)
        turn[:3, :3] = along(what)
        parts.append(pending @ turn)
        shifts.append(kind == PRISMATIC)
        pending = turn.T
    parts.append(pending)
    return Chain(parts[0], np.array(parts[1:]), np.array(shifts, dtype=bool))


def along(axis: Array) -> Array:
    """Axes (3, 3) of a frame whose z is a unit vector (3,), turned no further than needed."""
    axis = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    if axis[2] > 1.0 - 1e-12:
        return np.eye(3)
    if axis[2] < -1.0 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    x, y, z = axis
    return np.array(
        [
            [1.0 - x * x / (1.0 + z), -x * y / (1.0 + z), x],
            [-x * y / (1.0 + z), 1.0 - y * y / (1.0 + z), y],
            [-x, -y, z],
        ]
    )


def of_rows(rows: Array, kinds: Sequence[str], *, modified: bool = False) -> list[Motion]:
    """Return the motions of Denavit–Hartenberg rows θ₀, α (rad), d, a (m), each of a kind of joint.

    Standard: Rz(θ₀ + q) Tz(d) Tx(a) Rx(α). Modified (Craig): Rx(α) Tx(a) Rz(θ₀ + q) Tz(d), α and a of the
    link before. A prismatic joint shifts along z instead of turning; a fixed row has no joint.
    """
    motions: list[Motion] = []
    axis = np.array([0.0, 0.0, 1.0])
    for (theta, alpha, d, a), kind in zip(rows, kinds, strict=True):
        about_z, about_x = screw(2, theta, d), screw(0, alpha, a)
        joint: list[Motion] = [] if kind == FIXED else [(kind, axis)]
        before: list[Motion] = [(FIXED, about_x)] if modified else []
        motions += [*before, *joint, (FIXED, about_z), *([] if modified else [(FIXED, about_x)])]
    return motions


def screw(axis: int, angle: float, shift: float) -> Array:
    """Motion (4, 4): a turn about a coordinate axis and a shift along it."""
    c, s = np.cos(angle), np.sin(angle)
    matrix, (i, j) = np.eye(4), ((axis + 1) % 3, (axis + 2) % 3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i], matrix[axis, 3] = -s, s, shift
    return matrix


def chain_of_arm(arm: JSON, place: Array) -> Chain | None:
    """Return the chain of a cell's ``arm``; None where plain standard rows need none.

    ``place`` (4, 4): its base in a frame whose z points upwards.
    """
    motions: list[Motion] = [] if np.array_equal(place, np.eye(4)) else [(FIXED, place)]
    if arm.get("chain"):
        for joint in arm["chain"]:
            motions.append((FIXED, np.array(joint["origin"], dtype=float)))
            if joint["kind"] != FIXED:
                motions.append((joint["kind"], np.array(joint["axis"], dtype=float)))
        return chain(motions)
    kinds = arm.get("joints") or [REVOLUTE] * len(arm["dh"])
    modified = arm.get("convention") == "modified"
    if not (motions or modified or set(kinds) != {REVOLUTE}):
        return None
    rows = np.asarray(arm["dh"], dtype=float) * (DEG, DEG, MM, MM)
    return chain([*motions, *of_rows(rows, kinds, modified=modified)])
