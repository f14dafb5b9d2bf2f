"""An end mill as ground and clamped: unequal teeth, round corners, an axis set off and bent, and its wear."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from virtual_cell.chips import Tool
from virtual_cell.hidden import drawn_size
from virtual_cell.units import DEG, MM, UM, Array

CORNER_SLICES = 5
SLICE = 1.4 * DEG  # helix lag of one slice of the cylinder


@dataclass(frozen=True)
class RealTool(Tool):
    """A tool with what is wrong with it.

    Attributes
    ----------
    radial, axial : (N,) by how much each tooth stands proud of the others, outwards and downwards, m.
    twist : (N,) by how much the helix of each tooth is off, rad.
    corner : radius of the corner, m.
    bend, bend_angle : angle between the axes of tool and spindle, rad, and towards where, clockwise from
        tooth 0. The tool is bent where it is clamped, ``overhang`` (m) above its tip; ``runout`` is the
        offset there.
    """

    radial: Any = 0.0
    axial: Any = 0.0
    twist: Any = 0.0
    corner: float = 0.0
    bend: float = 0.0
    bend_angle: float = 0.0
    overhang: float = 0.0

    def axis(self, z: Array) -> Array:
        """Offset (S,) of the tool's axis at heights ``z``, as complex numbers: m, clockwise from tooth 0."""
        there = np.exp(1j * self.runout_angle) * self.runout
        return np.asarray(there + np.exp(1j * self.bend_angle) * self.bend * (self.overhang - z))

    def points(self, z: Array) -> tuple[Array, Array]:
        """Return radius and angle about the spindle axis, both (N, S), of the points at heights ``z``."""
        height = z + self.each(self.axial)
        bare = self.radius - self.drop(height) + self.each(self.radial)
        bare[self.chipped_tooth, z < self.chipped_height] -= self.chipped_by
        helix = self.helix + self.each(self.twist)
        angle = self.angles[:, None] - height * np.tan(helix) / self.radius
        seen = self.axis(z) * np.exp(-1j * angle)
        along, across = bare + seen.real, seen.imag
        return np.hypot(along, across), angle + np.arctan2(across, along)

    def drop(self, z: Array) -> Array:
        """Lengths (m) by which the corner leaves the cylinder at heights ``z``."""
        if self.corner == 0.0:
            return np.zeros_like(z)
        below = np.clip(self.corner - z, 0.0, self.corner)
        return np.asarray(self.corner - np.sqrt(self.corner**2 - below**2))

    def steepness(self, z: Array) -> Array:
        """Sine of the angle between the tool's axis and the normal of its envelope: 1 on the cylinder."""
        if self.corner == 0.0:
            return np.ones_like(z)
        below = np.clip(1.0 - z / self.corner, 0.0, 1.0)
        return np.asarray(np.sqrt(1.0 - below**2))

    def bounds(self, depth: float) -> Array:
        """Heights (S + 1,) that part the engaged edge into slices, finer along the corner."""
        angle = math.acos(max(1.0 - depth / self.corner, 0.0)) if self.corner > 0.0 else 0.0
        round_part = self.corner * (1.0 - np.cos(np.linspace(0.0, angle, CORNER_SLICES + 1)))
        left = depth - float(round_part[-1])
        if left <= 1e-3 * depth:
            return np.asarray(round_part)
        count = max(3, math.ceil(left * math.tan(abs(self.helix)) / self.radius / SLICE))
        straight = float(round_part[-1]) + left * np.arange(1, count + 1) / count
        return np.concatenate([round_part if self.corner > 0.0 else [0.0], straight])

    def each(self, values: Any) -> Array:
        """Return what differs from tooth to tooth as a column (N, 1)."""
        return np.broadcast_to(np.asarray(values, dtype=float), (self.teeth,))[:, None]


def drawn_tool(diameter: float, teeth: int, helix: float, rng: np.random.Generator) -> RealTool:
    """Draw a good tool of ``diameter`` m, as it comes out of the box and sits in a good holder."""
    unequal, spaced = drawn_size(rng, 1.0, 5.0) * UM, drawn_size(rng, 0.02, 0.2) * DEG
    tool = RealTool(
        radius=0.5 * diameter,
        helix=helix,
        angles=np.arange(teeth) * (2.0 * math.pi / teeth) + spread(teeth, rng) * spaced,
        radial=0.5 * unequal * spread(teeth, rng),
        axial=0.5 * unequal * spread(teeth, rng),
        twist=0.1 * DEG * spread(teeth, rng),
        corner=float(rng.uniform(0.1, 0.4)) * MM,
        overhang=diameter * float(rng.uniform(2.5, 4.0)),
    )
    return clamped(tool, drawn_size(rng, 1.0, 2.0) * UM, rng)


def spread(teeth: int, rng: np.random.Generator) -> Array:
    """Return deviations (N,) whose mean is 0 and of which the largest is 1."""
    raw = rng.standard_normal(teeth)
    raw -= raw.mean()
    return np.asarray(raw / max(float(np.abs(raw).max()), 1e-9))


def clamped(tool: RealTool, size: float, rng: np.random.Generator) -> RealTool:
    """Draw how a tool is clamped that runs out by ``size`` (m) at its tip: in part set off, in part bent."""
    bent, towards = float(rng.uniform(0.3, 0.9)), float(rng.uniform(0.0, 2.0 * math.pi))
    between = float(rng.uniform(-1.2, 1.2))  # the plane of the bend is not that of the offset
    total = abs(1.0 - bent + bent * np.exp(1j * between))
    return replace(
        tool,
        runout=(1.0 - bent) * size / total,
        runout_angle=towards,
        bend=bent * size / (total * tool.overhang),
        bend_angle=towards + between,
    )


def set_off(tool: RealTool, radius: float, angle: float, rng: np.random.Generator) -> RealTool:
    """Clamp a tool so that what it runs out by, unequal teeth included, is ``radius`` (m) at ``angle`` (rad).

    Part of it is an offset of the holder, part of it a bend.
    """
    at_rest = replace(tool, runout=0.0, bend=0.0)
    asked = radius * np.exp(1j * angle) - effective_runout(at_rest, 0.0)
    some = clamped(tool, float(abs(asked)), rng)
    turn = float(np.angle(asked) - np.angle(some.axis(np.zeros(1))[0]))
    return replace(some, runout_angle=some.runout_angle + turn, bend_angle=some.bend_angle + turn)


def effective_runout(tool: RealTool, z: float) -> complex:
    """Offset (m, clockwise from tooth 0) of a tool of equal teeth that would cut most alike at height ``z``.

    Unequal teeth differ in length as those of an eccentric tool do, of three teeth wholly so.
    """
    radial = np.broadcast_to(np.asarray(tool.radial, dtype=float), (tool.teeth,))
    (x, y, _), _ = _eccentric(tool, radial)
    return complex(tool.axis(np.array([z]))[0] + complex(x, y))


def uneven(tool: RealTool, depth: float) -> tuple[Array, float]:
    """By how much each tooth (N,) reaches farther, m, than an offset and another diameter make it.

    It is the mean over the slices of the ``depth`` (m): a lower tooth reaches farther out along the corner.
    The second value is the largest deviation from that mean (rms over the depth), relative to the largest
    reach.
    """
    edges = tool.bounds(depth)
    z, share = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges) / depth
    farther = tool.drop(z) - tool.drop(z + tool.each(tool.axial)) + tool.each(tool.radial)
    off = np.stack([_eccentric(tool, reach)[1] for reach in farther.T], axis=1)
    mean = off @ share
    apart = np.sqrt((off - mean[:, None]) ** 2 @ share).max()
    return mean, float(apart / max(np.abs(mean).max(), 1e-12))


def _eccentric(tool: RealTool, reach: Array) -> tuple[Array, Array]:
    """Offset along x and y and growth, m, that the reach (N,) of teeth resembles most, and the remainder."""
    ray = np.stack([np.cos(tool.angles), np.sin(tool.angles), np.ones(tool.teeth)], axis=1)
    found = np.linalg.lstsq(ray, reach, rcond=None)[0]
    return np.asarray(found), np.asarray(reach - ray @ found)


def uneven_pitch(tool: RealTool, z: float) -> Array:
    """Deviations (N,), rad, of the teeth from even spacing at height ``z``; they add up to nothing."""
    even = np.arange(tool.teeth) * (2.0 * math.pi / tool.teeth)
    twist = np.tan(tool.helix + np.broadcast_to(np.asarray(tool.twist, dtype=float), (tool.teeth,)))
    off = tool.angles - even - z * twist / tool.radius
    return np.asarray(off - off.mean())


@dataclass(frozen=True)
class Wear:
    """Flank wear: a land that is worn in and then grows steadily; forces grow with its width.

    Attributes
    ----------
    per_metre : growth of the edge force per metre cut once worn in, relative, in the radial direction.
    running_in, metres : what is worn in at once, relative, and over how many metres.
    direction : (3,) growth of tangential, radial and axial edge force in parts of that of the radial:
        friction on the land, not the fresh edge, says how they share.
    """

    per_metre: float
    running_in: float
    metres: float
    direction: tuple[float, float, float]

    def growth(self, metres: Array | float) -> Array:
        """Relative growth (…, 3) of the edge forces after so many metres."""
        m = np.asarray(metres, dtype=float)[..., None]
        land = self.per_metre * m + self.running_in * (1.0 - np.exp(-m / self.metres))
        return np.asarray(land * np.array(self.direction))


def drawn_wear(per_metre: float, session: float, edge: Array, rng: np.random.Generator) -> Wear:
    """Draw how a tool wears that loses, on the mean of a session of so many metres, ``per_metre``.

    ``edge`` (3,): the fresh edge's forces, tangential, radial, axial.
    """
    early = float(rng.uniform(0.05, 0.25))
    friction, along = float(rng.uniform(0.6, 1.0)), float(rng.uniform(0.15, 0.35))
    share = (friction * edge[1] / edge[0], 1.0, along * edge[1] / edge[2])
    whole = Wear(1.0 - early, early * session, 0.15 * session, share)
    size = per_metre / wear_per_metre(whole, session, edge)[0]
    return replace(whole, per_metre=size * whole.per_metre, running_in=size * whole.running_in)


def wear_per_metre(wear: Wear, session: float, edge: Array) -> tuple[float, float]:
    """Return the even growth per metre that is closest in force, and how far from it the true one is.

    The second is the rms difference over the rms growth.
    """
    metres = np.linspace(0.0, session, 41)
    true = wear.growth(metres) * edge
    even = metres[:, None] * edge
    slope = float((true * even).sum() / (even * even).sum())
    rest = true - slope * even
    return slope, float(np.sqrt((rest**2).mean() / max(float((true**2).mean()), 1e-30)))
