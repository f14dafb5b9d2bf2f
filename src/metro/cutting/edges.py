"""Where the cutting edges are at each angle of the tool, and the pieces of them that are in the cut.

In each piece one pass bounds the chip, so that all is smooth along it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from metro.compiled import compiled, compiled_with_arrays
from metro.cutting.arcs import EVERYWHERE, TURN, Arc, Near, empty_arc, find_arc
from metro.cutting.chip import Cut
from metro.cutting.corners import BEGINS, ENDS, LARGEST_STEP, RawEdges, beyond, is_outer, raw_here
from metro.cutting.cutter import Cutter
from metro.cutting.floor import Floor, floor_at, floor_of
from metro.cutting.passes import Passes, Row, Scale, chip_left, row_of
from metro.units import Array

Indices = npt.NDArray[np.intp]
HALVINGS = 30  # of a piece, in which an edge crosses the floor of a helix: 1e-9 of it
LOW, HIGH, LINES = 0, 1, 2  # columns of ``Pieces.bounds``


class Edges(NamedTuple):
    """Where the edges are at angles of the tool: ``top`` and a ``span`` below it.

    Attributes
    ----------
    top : (angles, N) immersion of the leading end of each edge, rad. span : what an edge spans, > 0, rad.
    depth : what a radian of edge spans, m/rad. tip_leads : whether that end is at the tip.
    floor : that the orbit before left on a helix.
    """

    top: Array
    span: float
    depth: float
    tip_leads: bool
    floor: Floor


def edges(cutter: Cutter, cut: Cut, angle: Array, *, step: float) -> Edges:
    """Return the edges at angles (n,) of tooth 0, a ``step`` apart, rad.

    One that lags by less than a step is spread over what it turns through in the step.
    """
    lag = cutter.lag_per_depth * cut.axial_depth
    span = max(abs(lag), step)
    top = angle[:, None] + np.asarray(cutter.tooth_angles) + 0.5 * (span - lag)
    return Edges(top, span, cut.axial_depth / span, lag >= 0.0, floor_of(cutter, cut))


class Pieces(NamedTuple):
    """Pieces of edges in the cut, in each of which one pass bounds the chip.

    Attributes
    ----------
    angle : (pieces,) index of the angle of the tool. bounding : (pieces,) of the pass, 0 the last one.
    bounds : (pieces, 4) immersions at which the piece begins and ends, rad; y of either raw edge, m, where
        the piece is in a corner of the work there, else not a number.
    passed, own : (pieces, 9) of the pass that bounds the chip, and of the tooth itself.
    scale : of the passes. depth : what a radian of edge spans, m/rad.
    """

    angle: Indices
    bounding: Indices
    bounds: Array
    passed: Array
    own: Array
    scale: Scale
    depth: float

    @property
    def length(self) -> Array:
        """What the pieces span, rad."""
        return np.asarray(self.bounds[:, HIGH] - self.bounds[:, LOW])


def pieces(before: Passes, raw: RawEdges, along: Edges) -> Pieces:
    """Cut the engaged part of each edge where the pass that bounds its chip changes."""
    return Pieces(*_pieces(before, raw, along, empty_arc(before.rows.shape[2])), along.depth)


@compiled_with_arrays
def _pieces(
    before: Passes, raw: RawEdges, along: Edges, arc: Arc
) -> tuple[Indices, Indices, Array, Array, Array, Scale]:
    """Return what ``Pieces`` are made of but for the depth."""
    scale, rows, top, span, ends = before.scale, before.rows, along.top, along.span, arc.bounds
    floor = along.floor
    (angles, teeth), raws = top.shape, raw.line.shape[1]
    alike = rows.shape[0] == 1 and rows.shape[1] == 1 and raws == 1
    least = math.cos(min(0.5 * span + LARGEST_STEP, math.pi)) - 1e-9
    count, found, room = 0, 0, 2 * angles * teeth
    places, bounds, whose = np.empty((room, 2), np.intp), np.empty((room, 4)), np.empty(room, np.intp)
    for i in range(angles):
        at = i % raws
        here = raw_here(raw, at)
        for j in range(teeth):
            if _in_air(top[i, j], span):
                continue
            passed = rows[i % rows.shape[0], j % rows.shape[1]]
            if count == 0 or not alike:  # else the bounds are those of the last edge
                middle = top[i, j] - 0.5 * span
                near = EVERYWHERE if alike else Near(math.sin(middle), math.cos(middle), least)
                count = find_arc(scale, passed, here, near, arc)
            leading = ends[0] + (top[i, j] - ends[0]) % TURN
            while leading - span < ends[count - 1]:
                if found + count > len(places):
                    places, bounds, whose = _twice(places), _twice(bounds), _twice(whose)
                for part in range(count - 1):
                    low, high = max(ends[part], leading - span), min(ends[part + 1], leading)
                    if floor.pitch > 0.0 and high > low:
                        low, high = _below(along, leading, low, high)
                    if high > low:
                        middle = 0.5 * (low + high)
                        places[found, 0], places[found, 1] = i, bounding_pass(scale, passed, middle)
                        whose[found] = j
                        bounds[found, LOW], bounds[found, HIGH] = low, high
                        bounds[found, LINES] = corner_line(here.line[BEGINS], arc.corner[BEGINS], middle)
                        bounds[found, LINES + 1] = corner_line(here.line[ENDS], arc.corner[ENDS], middle)
                        found += 1
                leading += TURN
    bounding, own = np.empty((found, rows.shape[3])), np.empty((found, rows.shape[3]))
    for k in range(found):
        i, j = places[k, 0] % rows.shape[0], whose[k] % rows.shape[1]
        for column in range(rows.shape[3]):
            bounding[k, column] = rows[i, j, places[k, 1], column]
            own[k, column] = rows[i, j, -1, column]
    angle, which = places[:found, 0].copy(), places[:found, 1].copy()
    return angle, which, bounds[:found].copy(), bounding, own, scale


@compiled
def _below(along: Edges, leading: float, low: float, high: float) -> tuple[float, float]:
    """Return the part of an edge from ``low`` to ``high`` that is below the floor of the orbit before.

    An edge crosses the floor once: along it the height changes faster than the floor does.
    """
    at_low, at_high = _depth_below(along, leading, low), _depth_below(along, leading, high)
    if at_low >= 0.0 and at_high >= 0.0:
        return low, high
    if at_low <= 0.0 and at_high <= 0.0:
        return low, low
    inside, outside = (low, high) if at_low > 0.0 else (high, low)
    for _ in range(HALVINGS):
        middle = 0.5 * (inside + outside)
        if _depth_below(along, leading, middle) > 0.0:
            inside = middle
        else:
            outside = middle
    return (low, inside) if at_low > 0.0 else (inside, high)


@compiled
def _depth_below(along: Edges, leading: float, immersion: float) -> float:
    """Return how far a point of an edge is below the floor, m."""
    behind = leading - immersion
    height = along.depth * (behind if along.tip_leads else along.span - behind)
    return floor_at(along.floor, math.sin(immersion), math.cos(immersion)) - height


@compiled
def corner_line(line: float, corner: Array, immersion: float) -> float:
    """Return the line of a raw edge where an immersion is in its corner, else not a number."""
    return line if (immersion - corner[0]) * (immersion - corner[1]) < 0.0 else math.nan


@compiled
def _in_air(top: float, span: float) -> bool:
    """Whether an edge is behind the axis and far from where chips begin or end, whatever the passes.

    No tooth cuts where its own pass, a turn ago, left nothing: where sin φ < 0 on circles, and about half the
    feed over the radius farther on true paths.
    """
    leading = (top - math.pi) % TURN  # from where circles leave the cut
    return leading - span > LARGEST_STEP and leading < math.pi - LARGEST_STEP


@compiled_with_arrays
def _twice(values: Array) -> Array:
    """Return an array with room for twice as many values."""
    return np.concatenate((values, np.empty_like(values)))


@compiled
def bounding_pass(scale: Scale, rows: Array, immersion: float) -> int:
    """Return which pass bounds the chip."""
    sine, cosine = math.sin(immersion), math.cos(immersion)
    which, least = 0, math.inf
    for m in range(len(rows)):
        chip = chip_left(scale, row_of(rows, m), sine, cosine)
        if chip < least:
            which, least = m, chip
    return which


class Piece(NamedTuple):
    """One of ``Pieces``."""

    passed: Row
    own: Row
    line: tuple[float, float]


@compiled
def piece_of(cut: Pieces, at: int) -> Piece:
    """Return one of the pieces."""
    line = (cut.bounds[at, LINES], cut.bounds[at, LINES + 1])
    return Piece(row_of(cut.passed, at), row_of(cut.own, at), line)


@compiled
def chip_of(scale: Scale, piece: Piece, sine: float, cosine: float) -> float:
    """Chip of a piece at an immersion, m."""
    chip = chip_left(scale, piece.passed, sine, cosine)
    if not math.isnan(piece.line[BEGINS]):
        edge = beyond(scale.radius, piece.own, piece.line[BEGINS], sine, cosine)
        chip = edge if is_outer(BEGINS, piece.line[BEGINS]) else chip - edge
    if not math.isnan(piece.line[ENDS]):
        edge = beyond(scale.radius, piece.own, piece.line[ENDS], sine, cosine)
        chip = edge if is_outer(ENDS, piece.line[ENDS]) else chip - edge
    return max(chip, 0.0)
