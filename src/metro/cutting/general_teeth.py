"""What a tooth of a general cutter finds at a place of its edge: chips at the local radius, raw edges."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from metro.compiled import compiled
from metro.cutting.chip import Cut, curve_excess, feed_per_radian, path_excess
from metro.cutting.cutter import Cutter, pitches
from metro.units import Array

# Where the tool's radius is not much larger than the feed, paths are no trochoids that cross a ray once:
# closer to the tip than this many feeds per tooth, the difference to circles is taken as that at this radius.
LEAST_RADIUS = 2.0

_path_excess, _curve_excess = compiled(path_excess), compiled(curve_excess)


class Spot(NamedTuple):
    """Where a tooth is at a place of its edge.

    Attributes
    ----------
    tooth : its number. radius : of the place, m. lag_sine, lag_cosine : of the angle by which the edge lags.
    sine, cosine : of the immersion.
    """

    tooth: int
    radius: float
    lag_sine: float
    lag_cosine: float
    sine: float
    cosine: float


class RawLine(NamedTuple):
    """A raw edge of the work along the feed, at ``line``, m, of y.

    ``there``: whether there is one. ``outer``: whether on true paths the outer part of the chip is there,
    else the inner one (metro.cutting.corners). ``side`` of y on which the tooth's rays cross it.
    """

    there: bool
    line: float
    outer: bool
    side: float


class Face(NamedTuple):
    """A face of the work square to the feed, at ``x``, m, and on which side the work is (±1; 0: no face).

    ``behind``: half of the cutter, of y, that the face ends as a whole (±1; 0: neither).
    """

    side: float
    x: float
    behind: float


class Reach(NamedTuple):
    """How far a tooth's ``tip`` is from the axis, m, and cosine of its immersion.

    ``least``: that it is beyond an edge which its ray does not cross, m.
    """

    tip: float
    cosine: float
    least: float


class Teeth(NamedTuple):
    """Teeth of a cutter in a cut.

    Attributes
    ----------
    true_path : whether the paths are trochoids, else circles. feed : m/rad. least : the radius below which
        paths are taken as at this one, m. curvature : of the path, 1/m.
    pitch : (passes, N) to the tooth that made each pass that may bound a chip, rad.
    off : (3, N + 1, N) deviation from the radius of the tooth some places ahead of each, m: shares of the
        cosine and of the sine of the lag angle, and what is steady; (3, 0, 0) where there is none.
    radius : of the cutter, m. begins, ends : raw edges. entry, exit : faces.
    """

    true_path: bool
    feed: float
    least: float
    curvature: float
    pitch: Array
    off: Array
    radius: float
    begins: RawLine
    ends: RawLine
    entry: Face
    exit: Face


def teeth_in(cutter: Cutter, cut: Cut, *, true_path: bool) -> Teeth:
    """Return the teeth of a cutter in a cut."""
    wobbles = bool(cutter.runout_radius or any(cutter.reach))
    passes = cutter.teeth if wobbles or (cut.curvature and true_path) else 1
    arc = cut.engagement
    entry, exit_ = cutter.radius * math.sin(arc.entry), cutter.radius * math.sin(arc.exit)
    return Teeth(
        true_path,
        feed_per_radian(cutter, cut),
        LEAST_RADIUS * cut.feed_per_tooth,
        cut.curvature if true_path else 0.0,
        pitches(cutter.tooth_angles, passes),
        _deviations(cutter) if wobbles else np.zeros((3, 0, 0)),
        cutter.radius,
        _raw_line(cutter.radius, arc.entry, arc.entry > 0.0 and not arc.entry_face, begins=True),
        _raw_line(cutter.radius, arc.exit, arc.exit < math.pi and not arc.exit_face, begins=False),
        Face(arc.entry_face * (1.0 if arc.entry < 0.5 * math.pi else -1.0), entry, -1.0),
        Face(arc.exit_face * (1.0 if arc.exit > 0.5 * math.pi else -1.0), exit_, 1.0),
    )


def _raw_line(radius: float, immersion: float, there: bool, *, begins: bool) -> RawLine:
    outer = (math.cos(immersion) < 0.0) == begins
    return RawLine(there, radius * math.cos(immersion), outer, 1.0 if outer != begins else -1.0)


def _deviations(cutter: Cutter) -> Array:
    """Deviations (3, N + 1, N) from the radius of the teeth 0…N places ahead of each, m."""
    towards = cutter.runout_angle - np.asarray(cutter.tooth_angles)
    reach = np.array(cutter.reach or np.zeros(cutter.teeth))
    wave = np.stack([*(cutter.runout_radius * np.array([np.cos(towards), -np.sin(towards)])), reach])
    ahead = np.arange(cutter.teeth + 1)[:, None] + np.arange(cutter.teeth)
    return np.asarray(wave[:, ahead % cutter.teeth])


def reach(teeth: Teeth, farthest: float, inner: float) -> tuple[float, float]:
    """Immersions between which teeth cut all that they cut, rad, whatever the height and the deviations.

    On true paths a tooth cuts from half the feed over the radius before circles do, of the pass a turn ago
    where teeth deviate, for that one is the tooth's own. A raw edge on the side of the axis on which teeth
    that are nearer to it pass it later than the others begins what they cut, and likewise one that they pass
    earlier ends it.

    Parameters
    ----------
    farthest, inner : the largest radius, with the deviations, and the least one, m.
    """
    travel = teeth.feed * float(teeth.pitch.max())
    beyond = math.asin(min(0.5 * travel / true_radius(teeth, inner), 1.0)) if teeth.true_path else 0.0
    low, high = -beyond, math.pi + beyond
    if teeth.begins.there and teeth.begins.outer:
        low = math.acos(max(-1.0, min(teeth.begins.line / farthest, 1.0)))
    if teeth.ends.there and teeth.ends.outer:
        high = math.acos(max(-1.0, min(teeth.ends.line / farthest, 1.0)))
    return low, high


def alone_from(teeth: Teeth, cutter: Cutter, inner: float) -> float:
    """Sine of the immersion from which on the last pass alone bounds chips that are no nearer than ``inner``.

    An older pass leaves more by (travel since) × sin φ, but for the deviations from the radius; on true
    paths, with a the feed per radian over the radius, by a share a of it less and by pitch × a² of the
    deviations, while what the square of the pitch makes only adds. Infinite on a curve.
    """
    if teeth.curvature or len(teeth.pitch) == 1:
        return math.inf
    apart = 2.0 * cutter.runout_radius + float(np.ptp(cutter.reach or 0.0))
    since = teeth.feed * float((teeth.pitch[1:] - teeth.pitch[0]).min())
    nearest = true_radius(teeth, inner) - apart
    lean = teeth.feed / nearest if teeth.true_path else 0.0
    if nearest <= 0.0 or lean >= 1.0:
        return math.inf
    return apart * (1.0 + float(teeth.pitch[0].max()) * lean**2) / (since * (1.0 - lean))


@compiled
def true_radius(teeth: Teeth, radius: float) -> float:
    """Return the radius at which paths are taken as true ones, m."""
    squares = radius * radius, teeth.least * teeth.least
    return math.sqrt(math.sqrt(squares[0] * squares[0] + squares[1] * squares[1]))


@compiled
def levels_at(teeth: Teeth, spot: Spot, levels: Array) -> int:
    """Write all that must be above zero where a tooth cuts, m: the chips first. Return how many chips.

    Each pass leaves a chip in the plane. On true paths a raw edge leaves of them what is beyond it, or before
    it: where it is between a tooth's tip and what was cleared, only that part of the chip is there.
    """
    passes, wobbles = len(teeth.pitch), teeth.off.size > 0
    sine, cosine = spot.sine, spot.cosine
    own = _wave(teeth.off, 0, spot) if wobbles else 0.0
    path = true_radius(teeth, spot.radius) if teeth.true_path else 0.0
    for m in range(passes):
        pitch = teeth.pitch[m, spot.tooth]
        earlier = _wave(teeth.off, m + 1, spot) if wobbles else 0.0
        chip = teeth.feed * pitch * sine + own - earlier
        if teeth.true_path:
            chip += _path_excess(teeth.feed, pitch, path + earlier, sine, cosine)
            chip += _curve_excess(teeth.curvature, teeth.feed * pitch) * cosine
        levels[m] = chip
    count = passes
    if teeth.true_path:
        reach_of = Reach(spot.radius + own, cosine, -teeth.radius)
        count = _at_raw_edge(teeth.begins, reach_of, levels, passes, count)
        count = _at_raw_edge(teeth.ends, reach_of, levels, passes, count)
    return count


@compiled
def _wave(off: Array, ahead: int, spot: Spot) -> float:
    """Deviation from the radius, m, of the tooth so many places ``ahead``."""
    wave: float = off[0, ahead, spot.tooth] * spot.lag_cosine + off[1, ahead, spot.tooth] * spot.lag_sine
    wave += off[2, ahead, spot.tooth]
    return wave


@compiled
def _at_raw_edge(edge: RawLine, tooth: Reach, levels: Array, passes: int, count: int) -> int:
    """Append what a raw edge leaves of the chips of a tooth."""
    if not edge.there:
        return count
    beyond = tooth.least
    if edge.side * tooth.cosine > 0.0:
        beyond = max(tooth.tip - edge.line / tooth.cosine, beyond)
    if edge.outer:
        levels[count] = beyond
        return count + 1
    for m in range(passes):
        levels[count + m] = levels[m] - beyond
    return count + passes


@compiled
def bounds_at(teeth: Teeth, spot: Spot, levels: Array, count: int) -> int:
    """Append how far a place is inside the work's faces and, on circular paths, its raw edges, m."""
    x, y = spot.radius * spot.sine, spot.radius * spot.cosine
    if not teeth.true_path and teeth.begins.there:
        levels[count] = teeth.begins.line - y
        count += 1
    if not teeth.true_path and teeth.ends.there:
        levels[count] = y - teeth.ends.line
        count += 1
    for face in (teeth.entry, teeth.exit):
        if face.side != 0.0:
            levels[count] = face.side * (x - face.x)
            count += 1
        if face.side < 0.0:
            levels[count] = face.behind * y
            count += 1
    return count
