"""Chip thickness by tracing: each tooth meets the surface that the teeth before it really left.

The path of every cutting point is the true trochoid of an eccentric, possibly damaged tool. Along the ray
from the spindle axis through the cutting point the surface is found where the N passes before it crossed that
ray, and where the raw block ends; the chip is what lies between the surface and the point. Feed frame: x
feed, z from tip to spindle, immersion from +y towards +x (clockwise seen from +z).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from virtual_cell.motion import Motion
from virtual_cell.units import DEG, Array

Path = Callable[[Array], tuple[Array, Array]]
_SLICE = 1.0 * DEG  # helix lag of one slice
_TRACE_STEPS = 2  # each gains a factor feed/(cutting speed), about 1e-3
_BEHIND = 0.1  # a trochoid cuts a little before 0 and after 180 degrees, a tooth that runs out further


@dataclass(frozen=True)
class Tool:
    """A cylindrical end mill as it really is.

    Attributes
    ----------
    radius : m. helix : rad. angles : (N,) of the teeth at the tip, clockwise from tooth 0, rad.
    runout, runout_angle : offset of the tool from the spindle axis (m), its direction clockwise from tooth 0
        (rad).
    chipped_tooth, chipped_by, chipped_height : a tooth that is shorter by some m up to some height (m) above
        the tip.
    """

    radius: float
    helix: float
    angles: Array
    runout: float = 0.0
    runout_angle: float = 0.0
    chipped_tooth: int = 0
    chipped_by: float = 0.0
    chipped_height: float = 0.0

    @property
    def teeth(self) -> int:
        """Number of teeth."""
        return len(self.angles)

    def points(self, z: Array) -> tuple[Array, Array]:
        """Return radius and angle about the spindle axis, both (N, S), of the points at heights ``z``."""
        bare = np.full((self.teeth, len(z)), self.radius)
        bare[self.chipped_tooth, z < self.chipped_height] -= self.chipped_by
        angle = self.angles[:, None] - z * (math.tan(self.helix) / self.radius)
        towards = self.runout_angle - angle
        along, across = bare + self.runout * np.cos(towards), self.runout * np.sin(towards)
        return np.hypot(along, across), angle + np.arctan2(across, along)


@dataclass(frozen=True)
class Engagement:
    """A tool on its way.

    ``spindle`` rad/s (clockwise), ``start_angle`` of tooth 0 at t = 0, axial ``depth``, m.
    """

    tool: Tool
    motion: Motion
    spindle: float
    start_angle: float
    depth: float

    def angle(self, t: Array) -> Array:
        """Angle of the spindle at times ``t`` (s), clockwise, rad."""
        return self.start_angle + self.spindle * t

    def before(self, t: Array, lag: Array) -> Array:
        """Return the times (s) at which the spindle stood by an angle ``lag`` (rad) behind that at ``t``."""
        return t - lag / self.spindle

    @property
    def slices(self) -> Array:
        """Mid-heights (S,) of the slices, m."""
        lag = self.depth * math.tan(abs(self.tool.helix)) / self.tool.radius
        count = max(3, math.ceil(lag / _SLICE))
        return (np.arange(count) + 0.5) * (self.depth / count)


@dataclass(frozen=True)
class Chips:
    """Cutting points of one tooth, or of all, in the front half of the tool.

    ``sample``, ``tooth`` and ``level`` index time, tooth and slice; ``t`` s; ``sin``, ``cos`` of the
    immersion; ``thickness`` of the chip, m (negative: no contact); ``radius`` of the cutting point, m.
    """

    sample: np.ndarray
    tooth: np.ndarray
    level: np.ndarray
    t: Array
    sin: Array
    cos: Array
    thickness: Array
    radius: Array


def lags(tool: Tool, slices: Array) -> Array:
    """Return by what angle (N, N, S), in (0, 2π], tooth [first index] follows tooth [second index]."""
    angle = tool.points(slices)[1]
    lag = np.mod(angle[None, :] - angle[:, None], 2.0 * np.pi)
    lag[np.arange(tool.teeth), np.arange(tool.teeth)] = 2.0 * np.pi
    return lag


def chips(
    engagement: Engagement, t: Array, tooth: int | None, past: Path | None = None, now: Array | float = 0.0
) -> Chips:
    """Trace the chips of one tooth, or of all (None), at times ``t`` (n,), s.

    The axis follows the motion, displaced by ``now`` (2, n), m; in earlier passes it was at ``past(t)``
    where that is given.
    """
    slices = engagement.slices
    radius, angle = engagement.tool.points(slices)
    lag = lags(engagement.tool, slices)
    teeth = np.arange(engagement.tool.teeth) if tooth is None else np.array([tooth])
    phi = engagement.angle(t)[:, None, None] + angle[teeth]
    ahead = np.sin(phi + engagement.motion.direction(t)[:, None, None]) > -_BEHIND
    sample, which, level = np.nonzero(ahead)
    which = teeth[which]
    sine, cosine = np.sin(phi[ahead]), np.cos(phi[ahead])
    x, y = (along[sample] for along in np.array(engagement.motion.centre(t)) + now)
    low, high = engagement.motion.block((x, y), (sine, cosine))
    for other in range(engagement.tool.teeth):
        passed = engagement.before(t[sample], lag[which, other, level])
        path = past or engagement.motion.centre
        cleared = _cleared(
            path, passed, (x, y), (sine, cosine), radius=radius[other][level], spindle=engagement.spindle
        )
        low = np.maximum(low, cleared)
    reach = radius[which, level]
    return Chips(sample, which, level, t[sample], sine, cosine, np.minimum(reach, high) - low, reach)


def _cleared(
    path: Path,
    passed: Array,
    axis: tuple[Array, Array],
    ray: tuple[Array, Array],
    *,
    radius: Array,
    spindle: float,
) -> Array:
    """Distance along the rays that an earlier pass cleared: where its trochoid crossed, near ``passed``."""
    shift = np.zeros_like(passed)
    for _ in range(_TRACE_STEPS):
        x, y = path(passed + shift)
        dx, dy = x - axis[0], y - axis[1]
        across = -(dx * ray[1] - dy * ray[0]) / radius
        shift = np.arcsin(across) / spindle
    return dx * ray[0] + dy * ray[1] + radius * np.sqrt(1.0 - across * across)


def chip_thickness(engagement: Engagement, t: Array) -> Array:
    """Return the chip thickness (n, N, S), m, of every tooth and slice at times ``t`` (s); zero in air."""
    h = np.zeros((len(t), engagement.tool.teeth, len(engagement.slices)))
    for tooth in range(engagement.tool.teeth):
        traced = chips(engagement, t, tooth)
        h[traced.sample, tooth, traced.level] = np.maximum(traced.thickness, 0.0)
    return h
