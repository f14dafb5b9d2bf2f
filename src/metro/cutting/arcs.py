"""Where around the tool a tooth cuts, at one angle of the tool: between its ends, and pass by pass.

Of the passes that may bound the chip the least counts. On circular paths each is A sin φ + B cos φ + C, so
ends and crossings of passes are closed forms; on true paths Newton steps from there settle them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from metro.compiled import compiled
from metro.cutting.corners import BEGINS, ENDS, LARGEST_STEP, RawHere, foot_at, is_outer, tip_at
from metro.cutting.passes import COSINE, LEVEL, SINE, Row, Scale, chip_left, chip_slope, row_of
from metro.units import Array

STEPS_TO_ENDS, STEPS = 3, 2  # an error of a crossing counts in second order only
TURN = 2.0 * math.pi


class Near(NamedTuple):
    """Sine and cosine of the middle of an edge, and the cosine of how far from it bounds matter to it."""

    sine: float
    cosine: float
    least: float


class Arc(NamedTuple):
    """Where a tooth cuts.

    Attributes
    ----------
    bounds : (``most_bounds``,) immersions, rising, between which one pass bounds the chip, rad. The first and
        the last are where the tooth starts and stops cutting: the first above the last where it does not cut.
        Along the feed it is the chip that begins and ends there: on true paths a little outside 0…π.
    corner : (2, 2) at each raw edge that teeth pass little by little the immersions at which the chip
        vanishes, and from or to which it is whole, rad.
    """

    bounds: Array
    corner: Array


EVERYWHERE = Near(0.0, 0.0, -1.0)


def empty_arc(passes: int) -> Arc:
    """Return an arc to be written, of a tooth with so many passes before it."""
    return Arc(np.empty(4 + passes * (passes - 1)), np.empty((2, 2)))


@compiled
def find_arc(scale: Scale, rows: Array, raw: RawHere, near: Near, arc: Arc) -> int:
    """Find the bounds of the arc of a tooth, and return how many they are.

    Parameters
    ----------
    rows : (passes, 9) of the passes. raw : edges of the work.
    near : around the edge; bounds elsewhere are left out, or are ends of circular paths. arc : is written.
    """
    bounds = arc.bounds
    low, high = _ends(scale, rows, near)
    count = _crossings(scale, rows, near, bounds)
    arc.corner[:] = math.nan
    if math.isnan(raw.line[BEGINS]):
        low = max(low, raw.immersion[BEGINS])
    else:
        vanishing, whole = _limits(scale, rows, near, raw, BEGINS)
        arc.corner[BEGINS, 0], arc.corner[BEGINS, 1] = vanishing, whole
        count, low = inserted(bounds, count, whole), max(low, vanishing)
    if math.isnan(raw.line[ENDS]):
        high = min(high, raw.immersion[ENDS])
    else:
        vanishing, whole = _limits(scale, rows, near, raw, ENDS)
        arc.corner[ENDS, 0], arc.corner[ENDS, 1] = vanishing, whole
        count, high = inserted(bounds, count, whole), min(high, vanishing)
    for at in range(1, count):
        bounds[at] = min(max(bounds[at], low), high)
    bounds[0], bounds[count] = low, high
    return count + 1


@compiled
def _limits(scale: Scale, rows: Array, near: Near, raw: RawHere, side: int) -> tuple[float, float]:
    """Immersions at a raw edge at which the chip vanishes, and from or to which it is whole, rad."""
    outer = is_outer(side, raw.line[side])
    tip = tip_at(scale.radius, rows, raw.line[side])
    foot = tip
    if _covers(near, math.sin(tip), math.cos(tip)):
        towards = 1.0 if (side == BEGINS) == outer else -1.0
        foot = foot_at(scale, rows, raw.line[side], towards, tip)
    return (tip, foot) if outer else (foot, tip)


@compiled
def _covers(near: Near, sine: float, cosine: float) -> bool:
    """Whether an immersion given by its sine and cosine matters."""
    return near.sine * sine + near.cosine * cosine > near.least


@compiled
def inserted(bounds: Array, count: int, value: float) -> int:
    """Insert a value among ``bounds[1:count]``, which rise, and return how far they go then."""
    at = count
    while at > 1 and bounds[at - 1] > value:
        bounds[at] = bounds[at - 1]
        at -= 1
    bounds[at] = value
    return count + 1


@compiled
def _ends(scale: Scale, rows: Array, near: Near) -> tuple[float, float]:
    """Find the ends of the arc where every pass leaves a chip."""
    low, high = -math.inf, math.inf
    for m in range(len(rows)):
        root = math.atan2(-rows[m, COSINE], rows[m, SINE])
        late = 0.0
        if rows[m, LEVEL] != 0.0:
            length = math.sqrt(rows[m, SINE] ** 2 + rows[m, COSINE] ** 2)
            if not rows[m, LEVEL] < length:  # a chip at any immersion
                continue
            late = math.asin(min(-rows[m, LEVEL] / length, 1.0))
        low, high = max(low, root + late), min(high, root + math.pi - late)
    if scale.true_path:
        low, high = _end(scale, rows, near, low, 1.0), _end(scale, rows, near, high, -1.0)
    return low, high


@compiled
def _end(scale: Scale, rows: Array, near: Near, end: float, inward: float) -> float:
    """Newton's steps from the end of circular paths, each to the innermost of where passes leave nothing."""
    if not _covers(near, math.sin(end), math.cos(end)):
        return end
    for _ in range(STEPS_TO_ENDS):
        sine, cosine = math.sin(end), math.cos(end)
        step = -math.inf
        for m in range(len(rows)):
            row = row_of(rows, m)
            growth = inward * chip_slope(scale, row, sine, cosine)
            value = chip_left(scale, row, sine, cosine)
            step = max(step, -value / growth if growth > 0.0 else -LARGEST_STEP)
        end += inward * min(max(step, -LARGEST_STEP), LARGEST_STEP)
    return end


@compiled
def _crossings(scale: Scale, rows: Array, near: Near, bounds: Array) -> int:
    """Write to ``bounds[1:]`` the immersions, rising, where two passes leave the same chip, less than others.

    Return the place after the last one.
    """
    # Between centres that the pass is a turn behind: so far, relative to feed, circles stray from true paths.
    stray = TURN * scale.feed / scale.radius if scale.true_path else 0.0
    margin = (0.6 * TURN * stray + 1e-9) * scale.feed
    count = 1
    for one in range(len(rows) - 1):
        for other in range(one + 1, len(rows)):
            a = rows[one, SINE] - rows[other, SINE]
            b = rows[one, COSINE] - rows[other, COSINE]
            level = rows[one, LEVEL] - rows[other, LEVEL]
            length = math.copysign(math.sqrt(a * a + b * b), b)
            if length == 0.0 or not abs(level) < abs(length):
                continue
            # Of the two crossings the first is that within 0…π; beside a level the other one may be, too.
            off = -level / length
            across = math.sqrt(1.0 - off * off)
            for side in (1.0, -1.0):
                sine = (off * a + side * across * b) / length
                cosine = (off * b - side * across * a) / length
                if not _covers(near, sine, cosine):
                    continue
                if side > 0.0 or level != 0.0:
                    counts = _is_least(rows, one, sine, cosine, margin)
                else:
                    counts = scale.true_path and -sine < stray  # a little outside 0…π
                if counts:
                    phi = _settled(scale, row_of(rows, one), row_of(rows, other), _around(sine, cosine))
                    count = inserted(bounds, count, phi)
    return count


@compiled
def _around(sine: float, cosine: float) -> float:
    """Return an immersion from its sine and cosine, from −π/2 to 3π/2: a chip is around π/2."""
    phi = math.atan2(sine, cosine)
    return phi + TURN if phi < -0.5 * math.pi else phi


@compiled
def _is_least(rows: Array, one: int, sine: float, cosine: float, margin: float) -> bool:
    """Whether on circles a pass leaves a chip, and none less by a margin, m."""
    crossed = rows[one, SINE] * sine + rows[one, COSINE] * cosine + rows[one, LEVEL]
    if not crossed > -margin:
        return False
    least = math.inf
    for m in range(len(rows)):
        least = min(least, rows[m, SINE] * sine + rows[m, COSINE] * cosine + rows[m, LEVEL])
    return bool(crossed < least + margin)


@compiled
def _settled(scale: Scale, one: Row, other: Row, phi: float) -> float:
    """Newton's steps from circular paths to where two passes leave the same chip."""
    if not scale.true_path:
        return phi
    for _ in range(STEPS):
        sine, cosine = math.sin(phi), math.cos(phi)
        value = chip_left(scale, one, sine, cosine) - chip_left(scale, other, sine, cosine)
        slope = chip_slope(scale, one, sine, cosine) - chip_slope(scale, other, sine, cosine)
        if slope == 0.0:
            break
        phi -= min(max(value / slope, -LARGEST_STEP), LARGEST_STEP)
    return phi
