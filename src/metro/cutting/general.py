"""Forces of a general cutter: integrals along the edges of its corner or ball and of its inclined flank.

The chip normal to the edge is that in the plane times sin κ (:mod:`metro.cutting.envelope`), its width a
length of the meridian. The radial force acts along the normal to the envelope, the axial force along the
meridian. Each edge is cut into panels (:mod:`metro.cutting.general_panels`).

Raw edges and faces of the work are met at the local radius.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from metro.compiled import compiled_with_arrays
from metro.cutting.arcs import TURN
from metro.cutting.chip import Cut, feed_per_radian
from metro.cutting.cutter import Cutter
from metro.cutting.edges import Edges
from metro.cutting.envelope import Meridian, meridian, place_at
from metro.cutting.general_panels import HEIGHT, RADIUS, Edge, Nodes, Scratch, panel_points
from metro.cutting.general_teeth import Teeth, alone_from, reach, teeth_in
from metro.cutting.law import EdgeLaw
from metro.cutting.quadrature import is_linear, rule
from metro.units import Array

Indices = npt.NDArray[np.intp]
Values = TypeVar("Values", Indices, Array)
POINTS = 4
FINE = 41  # places of a panel among which the first and the last one to cut are sought


class Window(NamedTuple):
    """Immersions between which edges cut, and ``inward`` of 0…π by which one pass alone matters, rad."""

    low: float
    high: float
    inward: float


class Points(NamedTuple):
    """Points of a quadrature along all edges, arrays (points,).

    Attributes
    ----------
    at : index of the angle of the tool and of the tooth, in one. sine, cosine : of the immersion.
    up, out : sine and cosine of the edge angle κ. chip : normal to the edge, m.
    width, edge : weights of an integral over the meridian and over the edge times cos(helix), m.
    """

    at: Indices
    sine: Array
    cosine: Array
    up: Array
    out: Array
    chip: Array
    width: Array
    edge: Array


class Outline(NamedTuple):
    """What a cutter looks like: heights and radii, m, and the angle by which the edge lags, rad, finely.

    ``inner``, ``outer``: the least and the largest radius of the nodes, m.
    """

    height: Array
    radius: Array
    lag: Array
    inner: float
    outer: float


@lru_cache(maxsize=1024)
def _nodes(bare: Cutter, depth: float, lag: float, feed: float, *, linear: bool) -> tuple[Nodes, Outline]:
    """Return the nodes of a cutter of which nothing but its end and its helix is given, and its outline."""
    line = meridian(bare, depth, lag, feed)
    places, weights = rule(POINTS, linear)
    shares = np.sort(np.concatenate([[0.0, 0.5, 1.0], places]))
    table = _places(line, lag, shares)
    fine = _places(line, lag, np.linspace(0.0, 1.0, FINE)).reshape(FINE * len(table), -1)
    radius = table[..., RADIUS]
    outline = Outline(
        fine[:, HEIGHT], fine[:, RADIUS], lag * fine[:, HEIGHT], float(radius.min()), float(radius.max())
    )
    return Nodes(line, lag, shares, np.isin(shares, places).nonzero()[0], weights, table), outline


@compiled_with_arrays
def _places(line: Meridian, lag: float, shares: Array) -> Array:
    """Return the places at shares of each panel, with sine and cosine of either lag angle (``Nodes``)."""
    table = np.empty((len(line.length), len(shares), 8))
    for panel in range(len(line.length)):
        for node in range(len(shares)):
            place, row = place_at(line, panel, shares[node]), table[panel, node]
            row[0], row[1], row[2], row[3] = place.height, place.radius, place.sine, place.cosine
            for at, angle in ((4, line.lag_per_depth * place.height), (6, lag * place.height)):
                row[at], row[at + 1] = math.sin(angle), math.cos(angle)
    return table


class General(NamedTuple):
    """A general cutter in a cut: the nodes of its edges, its teeth, between which immersions they cut."""

    nodes: Nodes
    teeth: Teeth
    window: Window
    outline: Outline


def general_basis(cutter: Cutter, law: EdgeLaw, cut: Cut, along: Edges, *, true_path: bool) -> Array:
    """Force on a general cutter per unit of each coefficient, (angles, 3, 6), with edges ``along``."""
    if cut.axial_depth <= 0.0:
        return np.zeros((len(along.top), 3, 6))
    general = in_cut(cutter, law, cut, 1.0 / along.depth, true_path=true_path)
    return np.asarray(forces(general, law, along).sum(axis=1))


def forces(general: General, law: EdgeLaw, along: Edges) -> Array:
    """Force on each tooth of a general cutter per unit of each coefficient, (angles, teeth, 3, 6).

    Shear in N per N/m² of chip area; edge in N per N/m of edge × cos(helix), as on a cylinder. Exact to 1e-5
    of the largest force on circular paths, to 1e-4 on true ones besides what ``LEAST_RADIUS`` says; but where
    an edge only just touches the end of the cut, the length that is cut is known to a few per cent.
    """
    nodes, teeth, window, _ = general
    found = _points(teeth, teeth._replace(pitch=teeth.pitch[:1]), nodes, along, window)
    return _summed(found, law.shear(found.chip), along.top.size).reshape(*along.top.shape, 3, 6)


def in_cut(cutter: Cutter, law: EdgeLaw, cut: Cut, lag: float, *, true_path: bool) -> General:
    """Return a general cutter in a cut whose edges lag by ``lag``, rad/m."""
    bare = replace(cutter, tooth_angles=(0.0,), runout_radius=0.0, runout_angle=0.0, reach=())
    feed, linear = cut.feed_per_tooth if true_path else 0.0, is_linear(law, feed_per_radian(cutter, cut))
    nodes, outline = _nodes(bare, cut.axial_depth, lag, feed, linear=linear)
    teeth = teeth_in(cutter, cut, true_path=true_path)
    farthest = outline.outer + cutter.runout_radius + max(map(abs, cutter.reach), default=0.0)
    alone = alone_from(teeth, cutter, outline.inner)
    inward = math.asin(alone) if alone < 1.0 else math.inf
    window = Window(*reach(teeth, farthest, cutter.radius - cutter.corner), inward)
    return General(nodes, teeth, window, outline)


@compiled_with_arrays
def _points(teeth: Teeth, alone: Teeth, nodes: Nodes, along: Edges, window: Window) -> Points:
    """Return the points of all edges; ``alone``: the teeth with their last pass alone."""
    top, span, passes = along.top, along.span, len(teeth.pitch)
    panels, count = nodes.table.shape[:2]
    most = 3 * passes + 6
    scratch = Scratch(np.empty((count + 1, most)), np.empty(2 + (count - 1) * most * (most + 1) // 2))
    room, found = 4 * top.size + len(scratch.breaks) * len(nodes.inner), 0
    place: Indices = np.empty(room, np.intp)
    rows = np.empty((room, 7))
    for i in range(top.shape[0]):
        for j in range(top.shape[1]):
            if (top[i, j] - window.low) % TURN >= window.high - window.low + span:
                continue
            leading = (top[i, j] - window.inward) % TURN if window.inward < math.pi else -1.0
            lonely = span <= leading <= math.pi - 2.0 * window.inward
            which = alone if lonely else teeth
            for panel in range(panels):
                if found + len(scratch.breaks) * len(nodes.inner) > room:
                    room *= 2
                    place, rows = _grown(place, room), _grown(rows, room)
                more = panel_points(which, nodes, Edge(j, panel, top[i, j]), scratch, rows[found:])
                place[found : found + more] = i * top.shape[1] + j
                found += more
    rows = rows[:found].T.copy()
    return Points(place[:found].copy(), rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6])


@compiled_with_arrays
def _grown(values: Values, room: int) -> Values:
    """Return an array with room for more values."""
    more = np.empty((room, *values.shape[1:]), values.dtype)
    more[: len(values)] = values
    return more


@compiled_with_arrays
def _summed(found: Points, shear: Array, count: int) -> Array:
    """Force per unit of each coefficient, (count, 3, 6)."""
    basis = np.zeros((count, 3, 6))
    for k in range(len(shear)):
        at = basis[found.at[k]]
        for column, size in ((0, shear[k] * found.width[k]), (3, found.edge[k])):
            ahead, aside = size * found.sine[k], size * found.cosine[k]
            at[0, column] -= aside
            at[1, column] += ahead
            at[0, column + 1] -= ahead * found.up[k]
            at[1, column + 1] -= aside * found.up[k]
            at[2, column + 1] += size * found.out[k]
            at[0, column + 2] += ahead * found.out[k]
            at[1, column + 2] += aside * found.out[k]
            at[2, column + 2] += size * found.up[k]
    return basis
