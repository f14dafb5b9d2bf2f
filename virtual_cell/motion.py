"""How the spindle axis travels over the work, and where the raw block is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from virtual_cell.units import Array


class Motion(Protocol):
    """How the spindle axis travels, and where the raw block is."""

    @property
    def speed(self) -> float:
        """Feed speed in the plane, m/s."""
        ...

    def centre(self, t: Array) -> tuple[Array, Array]:
        """Position (m) of the axis at times ``t`` (s)."""
        ...

    def direction(self, t: Array) -> Array:
        """Direction of feed ψ (rad), counter-clockwise from x."""
        ...

    def block(self, position: tuple[Array, Array], ray: tuple[Array, Array]) -> tuple[Array, Array]:
        """First and last distance (m) along the ray where there was raw material."""
        ...


def _clip(span: tuple[Array, Array], distance: Array, slope: Array) -> tuple[Array, Array]:
    """Restrict a span along rays to the half-plane in which ``distance + r·slope > 0``."""
    edge = -distance / np.where(np.abs(slope) < 1e-12, 1e-12, slope)
    low = np.where(slope > 0.0, np.maximum(span[0], edge), span[0])
    high = np.where(slope <= 0.0, np.minimum(span[1], edge), span[1])
    return low, high


def _everywhere(like: Array) -> tuple[Array, Array]:
    return np.full_like(like, -np.inf), np.full_like(like, np.inf)


@dataclass(frozen=True)
class Straight:
    """A straight cut along x at ``speed``, m/s, from ``start`` at t = 0; the block spans x = 0…``length``.

    ``side`` is ``slot``, ``up`` (material at +y) or ``down`` (material at −y), ``edge`` the distance of the
    block's free side from the axis (R − a_e), positive where the axis runs outside of the block.
    """

    speed: float
    start: float
    length: float = math.inf
    side: str = "slot"
    edge: float = 0.0

    def centre(self, t: Array) -> tuple[Array, Array]:
        """Position of the axis."""
        return self.start + self.speed * t, np.zeros_like(t)

    def direction(self, t: Array) -> Array:
        """Zero: the frame is the feed frame."""
        return np.zeros_like(t)

    def block(self, position: tuple[Array, Array], ray: tuple[Array, Array]) -> tuple[Array, Array]:
        """Span of raw material: entry face, exit face and the free side."""
        (x, y), (sx, sy) = position, ray
        span = _clip(_everywhere(x), x, sx)
        if math.isfinite(self.length):
            span = _clip(span, self.length - x, -sx)
        if self.side == "up":
            span = _clip(span, y - self.edge, sy)
        elif self.side == "down":
            span = _clip(span, -self.edge - y, -sy)
        return span


@dataclass(frozen=True)
class Orbit:
    """Helical milling: a circle of ``radius``, m, at ``rate``, rad/s, counter-clockwise positive.

    ``phase`` is the direction of feed at t = 0 (rad, counter-clockwise from work x), ``pitch`` the axial
    depth per orbit.
    """

    radius: float
    rate: float
    phase: float
    pitch: float

    @property
    def speed(self) -> float:
        """Feed speed of the tool's centre in the plane, m/s."""
        return self.radius * abs(self.rate)

    @property
    def ramp(self) -> float:
        """Angle of the helix of the path, rad."""
        return math.atan(self.pitch / (2.0 * math.pi * self.radius))

    def centre(self, t: Array) -> tuple[Array, Array]:
        """Position of the axis."""
        psi = self.direction(t)
        arm = math.copysign(self.radius, self.rate)
        return arm * np.sin(psi), -arm * np.cos(psi)

    def direction(self, t: Array) -> Array:
        """Direction of feed."""
        return self.phase + self.rate * t

    def block(self, position: tuple[Array, Array], ray: tuple[Array, Array]) -> tuple[Array, Array]:
        """Material all around."""
        del ray
        return _everywhere(position[0])

    def ceiling(self, direction: Array, sine: Array, cosine: Array, reach: Array) -> Array:
        """Height (m) above the tip up to which there is material at the ends of rays from the axis.

        The floor at a place was left when the tool last stood over it: the farther out it lies, the longer
        ago. A tool circling about the hole's axis covers the place while the axis is within an angle w of it:
        of the drop per orbit, 1 − w/π has come since. Outside of the hole, w = 0: there all of it is cut.
        """
        return np.asarray(self.pitch * (1.0 - self.covers(direction, sine, cosine, reach) / math.pi))

    def covers(self, direction: Array, sine: Array, cosine: Array, reach: Array) -> Array:
        """Angle (rad) of the axis about the hole's within which the tool covers the ends of rays."""
        side = math.copysign(1.0, self.rate)
        outward = np.sin(direction) * sine * side - np.cos(direction) * cosine * side
        across = np.cos(direction) * sine + np.sin(direction) * cosine
        return np.asarray(np.arctan2(np.abs(reach * across), self.radius + reach * outward))
