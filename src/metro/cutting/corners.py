"""Raw edges of the work along the feed, which the teeth on true paths pass little by little.

On the ray from the axis through a tooth the line of a raw edge along the feed is y / cos φ away. Where that
is between the tooth and what the teeth before it cleared, only a part of the chip is there: the outer part,
from the edge on, or, where the axis is on the other side of the edge, the inner part, which the tooth meets
before its tip is in the work.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from metro.compiled import compiled
from metro.cutting.engagement import Engagement
from metro.cutting.passes import Row, Scale, chip_left, chip_slope, row_of
from metro.units import Array

LARGEST_STEP = 0.3  # rad, from a bound to first order towards the true one
STEPS = 3
BEGINS, ENDS = 0, 1  # the edge that begins the arc, and the one that ends it
# Of the radius: an edge so near to the axis is passed within AT_ONCE × chip / radius, in rad. There a ray is
# along the edge, and where the two meet is the quotient of two numbers that are no more than rounding.
AT_ONCE = 1e-6


class RawEdges(NamedTuple):
    """The two raw edges as the axis passes them at angles of the tool, of which all may be alike.

    Attributes
    ----------
    immersion : (2, angles or 1) at which the arc begins and ends there, rad; infinite where it does not.
    line : (2, angles or 1) y of the edges that teeth pass little by little, m; not a number for others.
    """

    immersion: Array
    line: Array


class RawHere(NamedTuple):
    """The two raw edges at one angle of the tool, else as ``RawEdges``."""

    immersion: tuple[float, float]
    line: tuple[float, float]


def raw_edges(engagement: Engagement, radius: float, true_path: bool, aside: Array | None = None) -> RawEdges:
    """Return the raw edges of a cut; ``aside`` (angles,) m displaces a tool on true paths along y."""
    begins, ends = engagement.entry > 0.0, engagement.exit < math.pi
    passed = (
        true_path and begins and not engagement.entry_face,
        true_path and ends and not engagement.exit_face,
    )
    immersion = np.array([engagement.entry if begins else -math.inf, engagement.exit if ends else math.inf])
    cosine = np.array([math.cos(engagement.entry), math.cos(engagement.exit)])
    line = radius * cosine[:, None] - (np.zeros(1) if aside is None else aside)
    immersion = np.repeat(immersion[:, None], line.shape[1], axis=1)
    little_by_little = np.repeat(np.array(passed)[:, None], line.shape[1], axis=1)
    at_once = little_by_little & (np.abs(line) < AT_ONCE * radius)
    immersion[at_once] = np.arccos(line[at_once] / radius)
    return RawEdges(immersion, np.where(little_by_little & ~at_once, line, math.nan))


def shifted(raw: RawEdges, radius: float, aside: Array) -> RawEdges:
    """Return raw edges, which stay where they are, for a tool displaced along y by ``aside`` (angles,) m."""
    there = np.isfinite(raw.immersion)
    cosine = np.cos(np.where(there, raw.immersion, 0.0)) - aside / radius
    immersion = np.where(there, np.arccos(np.clip(cosine, -1.0, 1.0)), raw.immersion)
    return raw._replace(immersion=immersion, line=np.full(immersion.shape, math.nan))


@compiled
def raw_here(raw: RawEdges, at: int) -> RawHere:
    """Return the raw edges at one of the angles."""
    return RawHere((raw.immersion[0, at], raw.immersion[1, at]), (raw.line[0, at], raw.line[1, at]))


@compiled
def is_outer(side: int, line: float) -> bool:
    """Whether the outer part of the chip is there: the axis is not yet, or no longer, in the work."""
    return line < 0.0 if side == BEGINS else line > 0.0


@compiled
def beyond(radius: float, own: Row, line: float, sine: float, cosine: float) -> float:
    """How far the tip of a tooth is beyond an edge on the ray, m; ``own`` is the row of the tooth."""
    return radius + own.off_sine * sine + own.off_cosine * cosine + own.off_level - line / cosine


@compiled
def steepness(own: Row, line: float, sine: float, cosine: float) -> float:
    """Change of that with the immersion, m/rad."""
    return own.off_sine * cosine - own.off_cosine * sine - line * sine / (cosine * cosine)


@compiled
def tip_at(radius: float, rows: Array, line: float) -> float:
    """Immersion at which the tip meets the edge, rad; the tooth's own row is the last one."""
    own, phi = row_of(rows, len(rows) - 1), math.acos(min(max(line / radius, -1.0), 1.0))
    for _ in range(STEPS):
        sine, cosine = math.sin(phi), math.cos(phi)
        phi -= beyond(radius, own, line, sine, cosine) / steepness(own, line, sine, cosine)
    return phi


@compiled
def foot_at(scale: Scale, rows: Array, line: float, towards: float, tip: float) -> float:
    """Immersion at which the edge comes to what the first of the passes (passes, 9) cleared, rad.

    ``towards``: in which sense that is from the ``tip``. Where there is no chip at the tip it is there.
    """
    own, phi = row_of(rows, len(rows) - 1), tip
    for _ in range(STEPS):
        sine, cosine = math.sin(phi), math.cos(phi)
        edge = beyond(scale.radius, own, line, sine, cosine)
        slope = steepness(own, line, sine, cosine)
        step = math.inf
        for m in range(len(rows)):
            row = row_of(rows, m)
            lacking = chip_left(scale, row, sine, cosine) - edge
            growth = towards * (slope - chip_slope(scale, row, sine, cosine))
            step = min(step, lacking / growth if growth > 0.0 else LARGEST_STEP)
        phi += towards * min(max(step, -LARGEST_STEP), LARGEST_STEP)
    return phi if towards * (phi - tip) > 0.0 else tip
