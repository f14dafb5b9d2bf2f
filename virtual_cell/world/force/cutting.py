"""Force on a real tool: corner and periphery of unequal teeth in uneven metal, chips by true paths."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from virtual_cell.chips import Chips, Engagement, Path, chips
from virtual_cell.units import Array
from virtual_cell.world.force.cutter import RealTool
from virtual_cell.world.force.metal import Metal
from virtual_cell.world.force.spindle import Turning
from virtual_cell.world.force.travel import Circling

_CHUNK = 4096  # times that are traced at once: their points fit the cache


@dataclass(frozen=True)
class TrueEngagement(Engagement):
    """A tool on its way, on a spindle that does not turn evenly; ``bounds`` (S + 1,) part its slices, m."""

    turning: Turning
    bounds: Array

    def angle(self, t: Array) -> Array:
        """Angle of the spindle at times ``t`` (s), clockwise, rad."""
        return self.turning.at(t)

    def before(self, t: Array, lag: Array) -> Array:
        """Return the times (s) at which the spindle stood by an angle ``lag`` (rad) behind that at ``t``."""
        return self.turning.when(self.turning.at(t) - lag)

    @property
    def slices(self) -> Array:
        """Mid-heights (S,) of the slices, m."""
        return np.asarray(0.5 * (self.bounds[1:] + self.bounds[:-1]))


@dataclass(frozen=True)
class Points:
    """Cutting points: what a cause can depend on.

    ``t`` s; ``tooth``, its number; ``z`` above the tip, ``x`` and ``y`` in the frame of the motion, m.
    """

    t: Array
    tooth: np.ndarray
    z: Array
    x: Array
    y: Array


Change = Callable[[Points], tuple[Array | float, Array | float]]
Depth = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class Pass:
    """One pass of a tool through metal.

    Attributes
    ----------
    engagement, metal : the tool on its way, and what it cuts. shear, edge, bottom : factors of this run.
    wear : (3,) relative growth of the edge forces by now. changes : what else scales shear and edge forces at
        cutting points. depth : height of the material above the tip (m) at times and places along the path.
    """

    engagement: TrueEngagement
    metal: Metal
    shear: Array
    edge: Array
    bottom: Array
    wear: Array
    changes: tuple[Change, ...]
    depth: Depth

    @property
    def tool(self) -> RealTool:
        """The tool."""
        assert isinstance(self.engagement.tool, RealTool)
        return self.engagement.tool


@dataclass(frozen=True)
class Traced:
    """Chips of all teeth and what there is to cut.

    ``width`` of the slice that is engaged, m; ``steep``: sine of the angle between axis and normal;
    ``shear``, ``edge``: factors on the forces.
    """

    chips: Chips
    width: Array
    steep: Array
    shear: Array | float
    edge: Array | float


def traced(one: Pass, t: Array, past: Path | None = None, now: Array | float = 0.0) -> Traced:
    """Trace the chips of all teeth where there is material; ``past`` and ``now`` as in ``chips``."""
    engagement, tool = one.engagement, one.tool
    found = chips(engagement, t, None, past, now)
    low, high = engagement.bounds[found.level], engagement.bounds[found.level + 1]
    x, y = (along[found.sample] for along in engagement.motion.centre(t))
    ceiling = one.depth(found.t, x)
    motion = engagement.motion
    if isinstance(motion, Circling):
        left = motion.ceiling(motion.direction(found.t), found.sin, found.cos, found.radius)
        ceiling = ceiling - motion.pitch + left
    width = np.clip(ceiling, low, high) - low
    z = engagement.slices[found.level]
    shear: Array | float = 1.0
    edge: Array | float = 1.0
    if one.changes:
        points = Points(found.t, found.tooth, z, x + found.radius * found.sin, y + found.radius * found.cos)
        for change in one.changes:
            more = change(points)
            shear, edge = shear * more[0], edge * more[1]
    steep = tool.steepness(z + np.broadcast_to(tool.axial, (tool.teeth,))[found.tooth])
    return Traced(found, width, np.maximum(steep, 0.05), shear, edge)


def on_points(one: Pass, cut: Traced, thickness: Array) -> Array:
    """Return the force (3, points), N, on points that cut chips of ``thickness`` (m) along the ray.

    The chip stands normal to the envelope, which leans at the corner: what presses a tooth inwards along the
    cylinder presses it upwards there.
    """
    normal = thickness * cut.steep
    chip, rub = one.metal.cutting(normal) * cut.shear, one.metal.rubbing(normal) * cut.edge
    length = cut.width / cut.steep
    edge = one.metal.edge * one.edge * (1.0 + one.wear)
    tangential, inward, along = (
        (k * chip + e * rub) * length for k, e in zip(one.metal.shear * one.shear, edge, strict=True)
    )
    lean = np.sqrt(1.0 - cut.steep**2)
    radial, axial = inward * cut.steep - along * lean, along * cut.steep + inward * lean
    sine, cosine = cut.chips.sin, cut.chips.cos
    return np.stack([-tangential * cosine - radial * sine, tangential * sine - radial * cosine, axial])


def edge_force(one: Pass, t: Array) -> Array:
    """Return the force (n, 3), N, on the edges of a tool that does not yield, frame of the motion."""
    force = np.empty((len(t), 3))
    for start in range(0, len(t), _CHUNK):
        here = slice(start, start + _CHUNK)
        cut = traced(one, t[here])
        force[here] = summed(cut, on_points(one, cut, cut.chips.thickness), len(t[here])).T
    return force


def summed(cut: Traced, parts: Array, count: int) -> Array:
    """Add up what acts on points (k, points) at each of ``count`` times: (k, count)."""
    return np.stack([np.bincount(cut.chips.sample, part, count) for part in parts])


def on_a_ramp(one: Pass, motion: Circling, t: Array, force: Array) -> Array:
    """Lean the force (n, 3) of the edges along the ramp of a helical path and add that of the bottom edges.

    A tooth that stands lower than the one before it takes more of the way down, and drags the tool aside.
    """
    tool, psi, drop = one.tool, motion.direction(t), motion.drop(t)
    lean = np.arctan2(drop, motion.speed)
    along = force[:, 0] * np.cos(psi) + force[:, 1] * np.sin(psi)
    forward = along * np.cos(lean) + force[:, 2] * np.sin(lean)
    up = force[:, 2] * np.cos(lean) - along * np.sin(lean)
    shift = forward - along
    x, y = force[:, 0] + shift * np.cos(psi), force[:, 1] + shift * np.sin(psi)
    per_tooth = motion.cut_below(t) * 2.0 * math.pi / (one.engagement.spindle * tool.teeth)
    down = per_tooth > 0.0
    axial = np.broadcast_to(np.asarray(tool.axial, dtype=float), (tool.teeth,))
    ahead = np.roll(axial, -1)  # tooth j + 1 cuts before tooth j
    cutting, rubbing = one.metal.bottom[0] * one.bottom[0], one.metal.bottom[1] * one.bottom[1]
    turned = one.engagement.angle(t)
    for tooth in range(tool.teeth):
        taken = np.maximum(per_tooth + axial[tooth] - ahead[tooth], 0.0) * down
        pressed = tool.radius * (cutting * taken + rubbing * (taken > 0.0))
        dragged = one.metal.bottom_drag * pressed
        phi = turned + tool.angles[tooth]
        up = up + pressed
        x, y = x - dragged * np.cos(phi), y + dragged * np.sin(phi)
    return np.stack([x, y, up], axis=1)
