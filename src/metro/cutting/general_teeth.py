"""What the teeth of a general cutter find: chips at the local radius, and the edges of the work."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from metro.cutting.chip import Cut, curve_excess, feed_per_radian, path_excess
from metro.cutting.cutter import Cutter
from metro.cutting.envelope import Place
from metro.units import Array

Indices = npt.NDArray[np.intp]
# Where the tool's radius is not much larger than the feed, paths are no trochoids that cross a ray once:
# closer to the tip than this many feeds per tooth, the difference to circles is taken as that at this radius.
LEAST_RADIUS = 2.0


@dataclass(frozen=True)
class RawEdge:
    """A raw edge of the work along the feed, at ``line``, m, of y.

    ``outer``: whether the outer part of the chip is there, else the inner one (metro.cutting.corners).
    """

    line: float
    outer: bool
    begins: bool


@dataclass(frozen=True, eq=False)
class Teeth:
    """Teeth of a cutter in a cut.

    Attributes
    ----------
    passes : number of earlier passes that may bound a chip. pitch : (passes, N) to the tooth of each, rad.
    off : (N, 3, N) deviation from the radius of the tooth some places ahead of each, m: shares of the cosine
        and of the sine of the lag angle, and what is steady. raw : the raw edges.
    """

    cutter: Cutter
    cut: Cut
    true_path: bool
    passes: int
    pitch: Array
    off: Array
    raw: tuple[RawEdge, ...]

    @property
    def chip_count(self) -> int:
        """Number of chips of which the least counts."""
        if not self.true_path:
            return self.passes
        outer = sum(edge.outer for edge in self.raw)
        return self.passes * (1 + len(self.raw) - outer) + outer

    def chips(self, tooth: Indices, place: Place, sine: Array, cosine: Array) -> Array:
        """Chips in the plane of which the least counts, (chips, …) m, of teeth at places; all broadcast.

        Each pass leaves one. On true paths a raw edge leaves of them what is beyond it, or before it: where
        it is between a tooth's tip and what was cleared, only that part of the chip is there.
        """
        cutter, feed = self.cutter, feed_per_radian(self.cutter, self.cut)
        curvature = self.cut.curvature if self.true_path else 0.0
        off = bool(cutter.runout_radius or any(cutter.reach))
        if off:
            angle = cutter.lag_per_depth * place.height
            lag = np.cos(angle), np.sin(angle)
        own = self._wave(self.off[0], tooth, lag) if off else np.zeros(1)
        least = np.maximum(place.radius, LEAST_RADIUS * self.cut.feed_per_tooth)
        chips = []
        for step in range(1, self.passes + 1):
            pitch = self.pitch[step - 1][tooth]
            chip = (feed * pitch) * sine
            earlier = own
            if off and step < cutter.teeth:  # the last pass is the tooth's own
                earlier = self._wave(self.off[step], tooth, lag)
                chip += own - earlier
            if curvature:
                chip += curve_excess(curvature, feed * pitch) * cosine
            if self.true_path:
                chip += path_excess(feed, pitch, least + earlier, sine, cosine)
            chips.append(chip)
        if self.true_path:
            chips += self._at_raw_edges(chips, place.radius + own, cosine)
        return np.stack(chips) if len(chips) > 1 else chips[0][None]

    def _at_raw_edges(self, chips: list[Array], tip: Array, cosine: Array) -> list[Array]:
        """Return what raw edges leave of chips, of a tooth whose ``tip`` is so far from the axis, m."""
        left: list[Array] = []
        for edge in self.raw:
            side = 1.0 if edge.outer != edge.begins else -1.0  # of y on which rays cross it
            crossing = side * cosine > 0.0
            beyond = np.where(
                crossing, tip - edge.line / np.where(crossing, cosine, 1.0), -self.cutter.radius
            )
            np.maximum(beyond, -self.cutter.radius, out=beyond)
            left += [beyond] if edge.outer else [chip - beyond for chip in chips]
        return left

    def _wave(self, wave: Array, tooth: Indices, lag: tuple[Array, Array]) -> Array:
        """Deviations from the radius, m, of waves (3, N): along the lag's cosine and sine, and steady."""
        cosine, sine, steady = (part[tooth] for part in wave)
        return np.asarray(cosine * lag[0] + sine * lag[1] + (steady if self.cutter.reach else 0.0))

    def levels(self, tooth: Indices, place: Place, sine: Array, cosine: Array) -> Array:
        """All that must be above zero where a tooth cuts, (levels, …) m: the chips first."""
        chips = self.chips(tooth, place, sine, cosine)
        inside = self._inside(place, sine, cosine)
        return np.concatenate([chips, inside]) if inside else chips

    def _inside(self, place: Place, sine: Array, cosine: Array) -> list[Array]:
        """How far places are inside the work's faces and, on circular paths, its raw edges, m."""
        arc, radius = self.cut.engagement, self.cutter.radius
        x, y = place.radius * sine, place.radius * cosine
        inside = []
        if not self.true_path:
            inside += [edge.line - y if edge.begins else y - edge.line for edge in self.raw]
        if arc.entry_face:
            beyond = x - radius * math.sin(arc.entry)
            inside += [beyond] if arc.entry < 0.5 * math.pi else [-beyond, -y]
        if arc.exit_face:
            beyond = x - radius * math.sin(arc.exit)
            inside += [beyond] if arc.exit > 0.5 * math.pi else [-beyond, y]
        return inside


def teeth_in(cutter: Cutter, cut: Cut, *, true_path: bool) -> Teeth:
    """Return the teeth of a cutter in a cut."""
    curved = bool(cut.curvature) and true_path
    passes = cutter.teeth if curved or cutter.runout_radius or any(cutter.reach) else 1
    pitch = np.stack([cutter.pitch(step) for step in range(1, passes + 1)])
    arc = cut.engagement
    ends = [(arc.entry, True)] * (arc.entry > 0.0 and not arc.entry_face)
    ends += [(arc.exit, False)] * (arc.exit < math.pi and not arc.exit_face)
    raw = [
        RawEdge(cutter.radius * math.cos(end), (math.cos(end) < 0.0) == begins, begins)
        for end, begins in ends
    ]
    towards = cutter.runout_angle - np.asarray(cutter.tooth_angles)
    reach = np.array(cutter.reach or np.zeros(cutter.teeth))
    wave = np.stack([*(cutter.runout_radius * np.array([np.cos(towards), -np.sin(towards)])), reach])
    off = np.stack([np.roll(wave, -step, axis=1) for step in range(cutter.teeth)])
    return Teeth(cutter, cut, true_path, passes, pitch, off, tuple(raw))
