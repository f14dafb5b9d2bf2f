"""A straight line of an arm: angles, speeds, Jacobian and gravity anywhere along it, by splines."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from virtual_cell.arm import Arm
from virtual_cell.arm_cell import ArmCell, hardened, payload_torque
from virtual_cell.units import MM, Array

_NODE = 10.0 * MM  # between nodes angles have an error of (10 mm / reach)⁴ / 384: less than 1e-9 rad


@dataclass(frozen=True)
class Line:
    """A line in the base frame: at the nodes ``s`` (n,), m, along it joint angles ``q`` (n, 6), rad."""

    s: Array
    q: Array

    @property
    def length(self) -> float:
        """Length, m."""
        return float(self.s[-1])

    @cached_property
    def spline(self) -> Any:
        """Joint angles over the length."""
        from scipy.interpolate import CubicSpline

        return CubicSpline(self.s, self.q)

    @cached_property
    def turns(self) -> tuple[Array, ...]:
        """Where (m) each of the six joints turns round."""
        slopes = self.spline.derivative()
        roots = slopes.roots(extrapolate=False)
        return tuple(np.asarray(places)[np.isfinite(places)] for places in roots)

    def rate(self, s: Array, speed: float) -> Array:
        """Joint speeds (n, 6), rad/s, at lengths ``s`` and a feed, m/s."""
        rates: Array = self.spline(s, 1) * speed
        return rates


def line(arm: Arm, ends: tuple[Array, Array], axes: Array, start: Array) -> Line:
    """Line between two tip positions (base frame, m), fixed tool axes, from joint angles near ``start``."""
    length = float(np.linalg.norm(ends[1] - ends[0]))
    s = np.linspace(0.0, length, round(length / _NODE) + 1)
    q = [arm.reach(ends[0], axes, start)]
    for share in s[1:] / length:
        ahead = q[-1] if len(q) == 1 else 2.0 * q[-1] - q[-2]
        q.append(arm.reach(ends[0] + share * (ends[1] - ends[0]), axes, ahead))
    return Line(s, np.array(q))


@dataclass(frozen=True)
class Statics:
    """What loads make of a line, base frame, as splines over its length.

    ``jacobian`` (n, 3, 6) of the true tip; ``gravity``, ``payload`` (n, 6), N m; ``twist`` (n, 3): how the
    tip moves when the link that yields is twisted, m/rad.
    """

    jacobian: Any
    gravity: Any
    payload: Any
    twist: Any

    def torque(self, s: Array, force: Array) -> Array:
        """Torques (n, 6), N m, of forces (n, 3), N, on the tip, on the links."""
        return np.asarray(np.einsum("nai,na->ni", self.jacobian(s), force))


def statics(cell: ArmCell, along: Line) -> Statics:
    """Statics of a line for a cell with all that it hides."""
    from scipy.interpolate import CubicSpline

    at = np.array(cell.payload_at)
    columns = [
        [cell.true.jacobian(q)[:3] for q in along.q],
        [cell.arm.gravity(q) for q in along.q],
        [payload_torque(cell.arm, q, cell.payload, at) for q in along.q],
        [twist(cell, q) for q in along.q],
    ]
    return Statics(*(CubicSpline(along.s, np.array(values)) for values in columns))


def twist(cell: ArmCell, q: Array) -> Array:
    """Motion (3,), m/rad, of the true tip when the cell's soft link twists about its own x axis."""
    frame = cell.arm.frames(q)[cell.link]
    moved: Array = np.cross(frame[:3, 0], cell.true.pose(q)[0] - frame[:3, 3])
    return moved


def given_way(cell: ArmCell, loads: Statics, s: Array, force: Array) -> Array:
    """Displacement (n, 3), m, of the tip along a cut under forces (n, 3), N, all in the base frame.

    By the joints, the link that twists, and the tool, which bends across its axis.
    """
    joints = np.einsum("nai,ni->na", loads.jacobian(s), cell.torsion(loads.torque(s, force)))
    arm_of = loads.twist(s)
    link = cell.link_compliance * arm_of * np.einsum("na,na->n", arm_of, force)[:, None]
    axis = cell.turn[:, 2]
    bent = cell.tool_compliance * (force - np.outer(force @ axis, axis))
    moved: Array = joints + link + bent
    return moved


def under_load(cell: ArmCell, q: Array, force: Array) -> Array:
    """Displacement (3,), m, in a load test at joint angles ``q`` (6,) under ``force`` (3,), N, base frame.

    The joints are preloaded, so that gaps are closed, and what yields in the cut alone does not yield.
    """
    jacobian = cell.true.jacobian(q)[:3]
    torsion = hardened(jacobian.T @ force, cell.arm.stiffness, np.array(cell.cubic))
    arm_of = twist(cell, q)
    moved: Array = jacobian @ torsion + cell.link_compliance * arm_of * (arm_of @ force)
    return moved


def strayed(cell: ArmCell, along: Line, s: Array, speed: float) -> Array:
    """Tracking errors (n, 6), rad, of every pass: lag, ripple, and a bump after each reversal."""
    drives = cell.drives
    error = -along.rate(s, speed) * drives.lag + drives.ripple * np.sin(drives.ripple_order * along.spline(s))
    for joint, turns in enumerate(along.turns):
        for turn in turns:
            after = np.maximum((s - turn) / (4.0 * MM), 0.0)
            sign = np.sign(along.spline(turn, 2)[joint])  # of the speed after it
            error[:, joint] -= sign * drives.reversal[joint] * after * np.exp(1.0 - after)
    return np.asarray(error)
