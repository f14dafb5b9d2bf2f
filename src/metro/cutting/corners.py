"""The corners of raw edges: a tooth enters or leaves the work through its side little by little.

On the ray from the axis through a tooth the line of a raw edge along the feed is y / cos φ away. Where that
is between the tooth and what the teeth before it cleared, only a part of the chip is there: the outer part,
from the edge on, or, where the axis is on the other side of the edge, the inner part, which the tooth meets
before its tip is in the work.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from metro.cutting.engagement import Engagement
from metro.cutting.nearby import LARGEST_STEP, Nearby
from metro.cutting.passes import Passes
from metro.units import Array

STEPS = 3


@dataclass(frozen=True, eq=False)
class Corner:
    """A raw edge as the teeth pass it: arrays (angles, N), or 1 where all are alike.

    Attributes
    ----------
    begins : whether it begins the arc, else ends it. outer : whether the outer part of the chip is there.
    radius : m. line : y of the edge, m. off_sine, off_cosine : of the tooth's deviation from the radius, m.
    tip, foot : immersions at which the edge is where the tip is, and where what was cleared ends, rad.
    """

    begins: bool
    outer: bool
    radius: float
    line: Array
    off_sine: Array
    off_cosine: Array
    tip: Array
    foot: Array

    @property
    def limits(self) -> tuple[Array, Array]:
        """Immersions at which the chip vanishes, and from or to which it is whole, rad."""
        return (self.tip, self.foot) if self.outer else (self.foot, self.tip)

    def at(self, angle: npt.NDArray[np.intp], tooth: npt.NDArray[np.intp]) -> Corner:
        """Return the corner as teeth (n,) pass it at angles (n,)."""
        arrays = (self.line, self.off_sine, self.off_cosine, self.tip, self.foot)
        parts = (part[angle % part.shape[0], tooth % part.shape[1]] for part in arrays)
        return Corner(self.begins, self.outer, self.radius, *parts)

    def beyond(self, sine: Array, cosine: Array) -> Array:
        """How far the tip is beyond the edge on the ray, m."""
        off = self.off_sine * sine + self.off_cosine * cosine
        return np.asarray(self.radius + off - self.line / cosine)

    def steepness(self, sine: Array, cosine: Array) -> Array:
        """Change of that with the immersion, m/rad."""
        off = self.off_sine * cosine - self.off_cosine * sine
        return np.asarray(off - self.line * sine / cosine**2)


def corners(
    before: Passes, engagement: Engagement, near: Nearby, aside: Array | float = 0.0
) -> tuple[Corner, ...]:
    """Return the corners of a cut on true paths; ``aside`` (angles, 1) m displaces the tool along y."""
    ends = []
    if engagement.entry > 0.0 and not engagement.entry_face:
        ends.append(_corner(before, engagement.entry, near, aside, begins=True))
    if engagement.exit < math.pi and not engagement.exit_face:
        ends.append(_corner(before, engagement.exit, near, aside, begins=False))
    return tuple(ends)


def _corner(before: Passes, immersion: float, near: Nearby, aside: Array | float, *, begins: bool) -> Corner:
    """Find where tip and edge meet and, from there, where what was cleared and the edge do."""
    outer = (math.cos(immersion) < 0.0) == begins
    line = np.atleast_2d(before.radius * math.cos(immersion) - aside)
    own = before.off_sine[-1], before.off_cosine[-1]
    tip = np.arccos(np.clip(line / before.radius, -1.0, 1.0)) + np.zeros_like(own[0])
    corner = Corner(begins, outer, before.radius, line, *own, tip, tip)
    for _ in range(STEPS):
        sine, cosine = np.sin(tip), np.cos(tip)
        tip = tip - corner.beyond(sine, cosine) / corner.steepness(sine, cosine)
    at = np.nonzero(near.covers(np.sin(tip), np.cos(tip)))
    foot = tip.copy()
    foot[at] = _foot(before.before(*at), corner.at(*at), tip[at])
    return replace(corner, tip=tip, foot=foot)


def _foot(passed: Passes, corner: Corner, tip: Array) -> Array:
    """Immersion (n,) at which the edge comes to what the first of the passes (passes, n) cleared."""
    towards, phi = (1.0 if corner.begins == corner.outer else -1.0), tip
    for _ in range(STEPS):
        sine, cosine = np.sin(phi), np.cos(phi)
        lacking = passed.chip(sine, cosine) - corner.beyond(sine, cosine)
        growth = towards * (corner.steepness(sine, cosine) - passed.slope(sine, cosine))
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.where(growth > 0.0, lacking / growth, LARGEST_STEP).min(axis=0)
        phi = phi + towards * np.clip(step, -LARGEST_STEP, LARGEST_STEP)
    return np.where(towards * (phi - tip) > 0.0, phi, tip)  # where there is no chip at the tip: none
