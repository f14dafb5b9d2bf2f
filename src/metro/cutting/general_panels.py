"""The points of a quadrature along one panel of an edge of a general cutter.

A panel in which the tooth starts or stops cutting, or in which another chip comes to be the least, is cut
there, so that all is smooth between Gauss's points. Such changes are looked for between the nodes of a panel.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from metro.compiled import compiled
from metro.cutting.arcs import TURN, inserted
from metro.cutting.envelope import Meridian, Place, edge_length, place_at
from metro.cutting.general_teeth import Spot, Teeth, bounds_at, levels_at
from metro.units import Array

Indices = npt.NDArray[np.intp]
NEAR = 1e-5  # to where a panel is cut, as a share of the meridian
MARGIN = 0.05  # in feeds per tooth and pass: sin φ is 0.02 off its chord over a panel
ROOT_STEPS = 20  # at most
HEIGHT, RADIUS, SINE, COSINE, LAG_SINE, LAG_COSINE, TURN_SINE, TURN_COSINE = range(8)


class Nodes(NamedTuple):
    """Places of a meridian between which changes are looked for.

    Attributes
    ----------
    line : the meridian. lag : angle by which the edge turns back per height, rad/m.
    shares : (nodes,) of a panel: its ends, its middle and Gauss's points. inner : (points,) which are those.
    weights : (points,) of Gauss's points.
    table : (panels, nodes, 8) what is known there: ``HEIGHT``, ``RADIUS``, sine and cosine of κ, of the angle
        by which the edge lags, and of that by which it is turned back, which without a helix is not the same.
    """

    line: Meridian
    lag: float
    shares: Array
    inner: Indices
    weights: Array
    table: Array


class Edge(NamedTuple):
    """A panel of an edge: numbers of the tooth and of the panel, and immersion of the leading end, rad."""

    tooth: int
    panel: int
    top: float


class Scratch(NamedTuple):
    """Room for the levels at the nodes of a panel and at one place more, and for where the panel is cut."""

    levels: Array
    breaks: Array


class Pair(NamedTuple):
    """Two levels of ``total``, the second one zero if it is that, in a cell from ``start`` of a ``size``.

    ``at_zero``, ``at_one``: their difference at the cell's ends.
    """

    first: int
    second: int
    total: int
    start: float
    size: float
    at_zero: float
    at_one: float


class Cell(NamedTuple):
    """The part of a panel from one node to the next.

    Attributes
    ----------
    at : number of the node. chips, total : how many levels there are. found : breaks found so far.
    """

    at: int
    chips: int
    total: int
    found: int


@compiled
def panel_points(teeth: Teeth, nodes: Nodes, edge: Edge, scratch: Scratch, rows: Array) -> int:
    """Write the points of one panel of an edge to ``rows`` and return how many they are."""
    tooth, panel, top = edge
    levels, breaks, table = scratch.levels, scratch.breaks, nodes.table[panel]
    count, sine, cosine = len(table), math.sin(top), math.cos(top)
    chips = total = 0
    for k in range(count):
        spot = _node_spot(tooth, sine, cosine, table, k)
        chips = levels_at(teeth, spot, levels[k])
        total = bounds_at(teeth, spot, levels[k], chips)
    found, changed = 1, False
    for k in range(count - 1):
        if _changes(levels[k], levels[k + 1], chips, total):
            changed = True
            found = _broken(teeth, nodes, edge, Cell(k, chips, total, found), scratch)
    length = nodes.line.length[panel]
    if not changed:
        if not _positive(levels[0], total):
            return 0
        for k, at in enumerate(nodes.inner):
            node = Place(table[at, HEIGHT], table[at, RADIUS], table[at, SINE], table[at, COSINE])
            spot = _node_spot(tooth, sine, cosine, table, at)
            _write(rows, k, nodes.line, (node, spot), (_least(levels[at], chips), nodes.weights[k] * length))
        return len(nodes.inner)
    breaks[0], breaks[found] = 0.0, 1.0
    written, here = 0, levels[count]
    for part in range(found):
        low, size = breaks[part], breaks[part + 1] - breaks[part]
        if not size > 0.0:
            continue
        _, spot = _spot(nodes, edge, low + 0.5 * size)
        bounds_at(teeth, spot, here, levels_at(teeth, spot, here))
        if not _positive(here, total):
            continue
        for k, at in enumerate(nodes.inner):
            node, spot = _spot(nodes, edge, low + nodes.shares[at] * size)
            levels_at(teeth, spot, here)
            chip_and_width = _least(here, chips), nodes.weights[k] * size * length
            _write(rows, written, nodes.line, (node, spot), chip_and_width)
            written += 1
    return written


@compiled
def _node_spot(tooth: int, sine: float, cosine: float, table: Array, at: int) -> Spot:
    """Where a tooth is at a node of a panel, with the leading end of the edge at a sine and cosine."""
    s, c = table[at, TURN_SINE], table[at, TURN_COSINE]
    return Spot(
        tooth,
        table[at, RADIUS],
        table[at, LAG_SINE],
        table[at, LAG_COSINE],
        sine * c - cosine * s,
        cosine * c + sine * s,
    )


@compiled
def _spot(nodes: Nodes, edge: Edge, share: float) -> tuple[Place, Spot]:
    """Return the place at a share of a panel, and where a tooth is there."""
    place = place_at(nodes.line, edge.panel, share)
    lag, phi = nodes.line.lag_per_depth * place.height, edge.top - nodes.lag * place.height
    spot = Spot(edge.tooth, place.radius, math.sin(lag), math.cos(lag), math.sin(phi), math.cos(phi))
    return place, spot


@compiled
def _positive(levels: Array, total: int) -> bool:
    return _least(levels, total) > 0.0


@compiled
def _least(levels: Array, count: int) -> float:
    least: float = levels[0]
    for at in range(1, count):
        least = min(least, levels[at])
    return least


@compiled
def _changes(low: Array, high: Array, chips: int, total: int) -> bool:
    """Whether between two nodes a tooth starts or stops cutting, or another chip comes to be the least."""
    starts = False
    for level in range(total):
        if not (low[level] > 0.0 or high[level] > 0.0):
            return False
        starts |= (low[level] > 0.0) != (high[level] > 0.0)
    return starts or _which(low, chips) != _which(high, chips)


@compiled
def _which(levels: Array, chips: int) -> int:
    which = 0
    for chip in range(1, chips):
        if levels[chip] < levels[which]:
            which = chip
    return which


@compiled
def _broken(teeth: Teeth, nodes: Nodes, edge: Edge, cell: Cell, scratch: Scratch) -> int:
    """Insert among the breaks where levels vanish or chips are equal in a cell; return how many there are."""
    at, chips, total, found = cell
    low, high = scratch.levels[at], scratch.levels[at + 1]
    start, size = nodes.shares[at], nodes.shares[at + 1] - nodes.shares[at]
    passes = len(teeth.pitch)
    margin = MARGIN * TURN * teeth.feed * passes / teeth.pitch.shape[1] if chips == passes else math.inf
    for first in range(total):
        for second in range(first + 1, total + 1):
            if second < total and second >= chips:
                continue  # two chips, or a level and zero
            a = low[first] - (low[second] if second < total else 0.0)
            b = high[first] - (high[second] if second < total else 0.0)
            if not a * b < 0.0:
                continue
            # Most passes cross where others leave less. By chords chips are known to less than the margin.
            share = a / (a - b)
            if low[first] + share * (high[first] - low[first]) < _chord(low, high, share, chips) + margin:
                pair = Pair(first, second, total, start, size, a, b)
                share = start + size * _root(teeth, nodes, edge, pair, scratch.levels[-1])
                found = inserted(scratch.breaks, found, share)
    return found


@compiled
def _chord(low: Array, high: Array, share: float, chips: int) -> float:
    """Return the least chip at a share between two nodes, by chords, m."""
    least = math.inf
    for chip in range(chips):
        least = min(least, low[chip] + share * (high[chip] - low[chip]))
    return least


@compiled
def _root(teeth: Teeth, nodes: Nodes, edge: Edge, pair: Pair, levels: Array) -> float:
    """Where two levels are equal, as a share of a cell, at whose ends their difference has unlike signs.

    By inverse quadratic interpolation through the ends of the bracket and the point that it lost last, or at
    the bracket's middle where that leads out of it. Near the root the error of a step is of the order of the
    product of the errors of the three points, so that one after a step of less than ``NEAR`` is much less.
    """
    a, b, fa, fb = 0.0, 1.0, pair.at_zero, pair.at_one
    x = fa / (fa - fb)
    near = NEAR * nodes.line.length.sum() / (nodes.line.length[edge.panel] * pair.size)
    for _ in range(ROOT_STEPS):
        _, spot = _spot(nodes, edge, pair.start + pair.size * x)
        bounds_at(teeth, spot, levels, levels_at(teeth, spot, levels))
        fx = levels[pair.first] - (levels[pair.second] if pair.second < pair.total else 0.0)
        if fx == 0.0:
            return x
        if fx * fb < 0.0:
            c, fc, a, fa = a, fa, b, fb
        else:
            c, fc = b, fb
        b, fb = x, fx
        step = fb / (fa - fc) * ((a - b) * fc / (fa - fb) - (c - b) * fa / (fc - fb))
        if not (step * (a - b) >= 0.0 and abs(step) <= abs(a - b)):
            step = 0.5 * (a - b)
        x = b + step
        if abs(step) < near:
            break
    return x


@compiled
def _write(
    rows: Array, k: int, line: Meridian, at: tuple[Place, Spot], chip_and_width: tuple[float, float]
) -> None:
    """Write a point of the quadrature: a place, where the tooth is there, chip in the plane and width, m."""
    (place, spot), (chip, width) = at, chip_and_width
    rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3] = spot.sine, spot.cosine, place.sine, place.cosine
    rows[k, 4] = max(chip, 0.0) * place.sine
    rows[k, 5], rows[k, 6] = width, width * edge_length(line, place)
