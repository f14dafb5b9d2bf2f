"""What the teeth of a general cutter find: chips at the local radius, and the edges of the work."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from metro.cutting.chip import Cut, curve_excess, feed_per_radian
from metro.cutting.cutter import Cutter, pitches
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
    off : (3, N + 1, N) deviation from the radius of the tooth some places ahead of each, m: shares of the
        cosine and of the sine of the lag angle, and what is steady; (3, 0, 0) where there is none.
    raw : the raw edges.
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

    @property
    def only_passes(self) -> bool:
        """Whether nothing but passes bounds what a tooth cuts."""
        arc = self.cut.engagement
        return not (self.raw or arc.entry_face or arc.exit_face)

    @property
    def outside(self) -> float:
        """Sine of the immersion behind which no tooth cuts: on true paths half the feed over the radius.

        Of the pass a turn ago where teeth deviate, for that one is the tooth's own.
        """
        inner = np.array(self.cutter.radius - self.cutter.corner)
        return (
            0.5 * self.passes * self.cut.feed_per_tooth / float(self.least(inner)) if self.true_path else 0.0
        )

    def reach(self, radius: float) -> tuple[float, float]:
        """Immersions between which teeth cut all that they cut, rad, whatever the height and the deviations.

        A raw edge on the side of the axis on which teeth that are nearer to it pass it later than the others
        begins what they cut, and likewise one that they pass earlier ends it.

        Parameters
        ----------
        radius : the largest one, m.
        """
        beyond = math.asin(min(self.outside, 1.0))
        low, high = -beyond, math.pi + beyond
        farthest = radius + self.cutter.runout_radius + float(np.abs(self.cutter.reach or 0.0).max())
        for edge in self.raw:
            at = math.acos(max(-1.0, min(edge.line / farthest, 1.0)))
            if edge.outer and edge.begins:
                low = at
            elif edge.outer:
                high = at
        return low, high

    def alone_from(self, radius: float) -> float:
        """Sine of the immersion from which on the last pass alone bounds chips that are no nearer than that.

        An older pass leaves more by (travel since) × sin φ, but for the deviations from the radius; on true
        paths, with a the feed per radian over the radius, by a share a of it less and by pitch × a² of the
        deviations, while what the square of the pitch makes only adds. Infinite on a curve.

        Parameters
        ----------
        radius : the least one, m.
        """
        if self.cut.curvature and self.true_path:
            return math.inf
        feed = feed_per_radian(self.cutter, self.cut)
        apart = 2.0 * self.cutter.runout_radius + float(np.ptp(self.cutter.reach or 0.0))
        since = feed * float((self.pitch[1:] - self.pitch[0]).min())
        nearest = float(self.least(np.array(radius))) - apart
        lean = feed / nearest if self.true_path else 0.0
        if nearest <= 0.0 or lean >= 1.0:
            return math.inf
        return apart * (1.0 + float(self.pitch[0].max()) * lean**2) / (since * (1.0 - lean))

    def least(self, radius: Array) -> Array:
        """Return the radius at which paths are taken as true ones, m."""
        return np.sqrt(np.sqrt(radius**4 + (LEAST_RADIUS * self.cut.feed_per_tooth) ** 4))

    def after(
        self, passed: Indices | np.intp, tooth: Indices, place: Place, sine: Array, cosine: Array
    ) -> Array:
        """Chips in the plane that passes 0… leave to teeth at places, m; all broadcast.

        On true paths with :func:`metro.cutting.chip.path_excess`, put so that it takes few temporaries.
        """
        feed = feed_per_radian(self.cutter, self.cut)
        pitch = self.pitch[passed, tooth]
        travel = feed * pitch
        earlier: Array | float = 0.0
        cleared: Array | float = 0.0
        if self.off.size:
            lag = self._lag(place)
            earlier = self._wave(passed + 1, tooth, lag)
            cleared = self._wave(np.intp(0), tooth, lag) - earlier
        if self.true_path:
            lean = feed / (self.least(place.radius) + earlier) * cosine
            rest = 1.0 - lean
            lean *= rest
            rest *= cosine
            chip = 0.5 * pitch * rest
            chip -= sine
            chip *= lean
            chip += sine
            chip *= travel
            if self.cut.curvature:
                chip += curve_excess(self.cut.curvature, travel) * cosine
        else:
            chip = travel * sine
        if self.off.size:
            chip += cleared
        return np.asarray(chip)

    def chips(self, tooth: Indices, place: Place, sine: Array, cosine: Array) -> Array:
        """Chips in the plane of which the least counts, (chips, …) m, of teeth at places; all broadcast.

        Each pass leaves one. On true paths a raw edge leaves of them what is beyond it, or before it: where
        it is between a tooth's tip and what was cleared, only that part of the chip is there.
        """
        last = self.after(np.intp(0), tooth, place, sine, cosine)
        chips = np.empty((self.passes, *last.shape))
        chips[0] = last
        for older in range(1, self.passes):  # one by one: each fits a cache, all together do not
            chips[older] = self.after(np.intp(older), tooth, place, sine, cosine)
        if not (self.true_path and self.raw):
            return chips
        own = self._wave(np.intp(0), tooth, self._lag(place)) if self.off.size else 0.0
        return np.concatenate([chips, *self._at_raw_edges(chips, place.radius + own, cosine)])

    def _at_raw_edges(self, chips: Array, tip: Array, cosine: Array) -> list[Array]:
        """Return what raw edges leave of chips, of a tooth whose ``tip`` is so far from the axis, m."""
        left: list[Array] = []
        for edge in self.raw:
            side = 1.0 if edge.outer != edge.begins else -1.0  # of y on which rays cross it
            crossing = side * cosine > 0.0
            beyond = np.where(
                crossing, tip - edge.line / np.where(crossing, cosine, 1.0), -self.cutter.radius
            )
            np.maximum(beyond, -self.cutter.radius, out=beyond)
            left.append(np.broadcast_to(beyond, chips.shape[1:])[None] if edge.outer else chips - beyond)
        return left

    def _lag(self, place: Place) -> tuple[Array, Array]:
        angle = self.cutter.lag_per_depth * place.height
        return np.cos(angle), np.sin(angle)

    def _wave(self, ahead: Indices | np.intp, tooth: Indices, lag: tuple[Array, Array]) -> Array:
        """Deviations from the radius, m, of the teeth so many places ``ahead``, where the lag is so."""
        cosine, sine, steady = self.off[:, ahead, tooth]
        wave = cosine * lag[0] + sine * lag[1]
        return np.asarray(wave + steady if self.cutter.reach else wave)

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
    wobbles = bool(cutter.runout_radius or any(cutter.reach))
    passes = cutter.teeth if wobbles or (cut.curvature and true_path) else 1
    pitch = pitches(cutter.tooth_angles, passes)
    arc = cut.engagement
    ends = [(arc.entry, True)] * (arc.entry > 0.0 and not arc.entry_face)
    ends += [(arc.exit, False)] * (arc.exit < math.pi and not arc.exit_face)
    raw = [
        RawEdge(cutter.radius * math.cos(end), (math.cos(end) < 0.0) == begins, begins)
        for end, begins in ends
    ]
    off = _deviations(cutter) if wobbles else np.zeros((3, 0, 0))
    return Teeth(cutter, cut, true_path, passes, pitch, off, tuple(raw))


def _deviations(cutter: Cutter) -> Array:
    """Deviations (3, N + 1, N) from the radius of the teeth 0…N places ahead of each, m."""
    towards = cutter.runout_angle - np.asarray(cutter.tooth_angles)
    reach = np.array(cutter.reach or np.zeros(cutter.teeth))
    wave = np.stack([*(cutter.runout_radius * np.array([np.cos(towards), -np.sin(towards)])), reach])
    ahead = np.arange(cutter.teeth + 1)[:, None] + np.arange(cutter.teeth)
    return np.asarray(wave[:, ahead % cutter.teeth])
