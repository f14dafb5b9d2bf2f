"""The envelope of a general cutter: where its edge is along the meridian, and how the edge is inclined there.

From the tip outwards the meridian is a flat bottom, the arc of the corner and a straight flank, each tangent
to the next, as in the APT tool with five of its parameters (Engin and Altintas, Int. J. Mach. Tools Manuf. 41
(2001) 2195). A corner radius equal to the radius is a ball end, an inclined flank a taper or an insert with a
cutting edge angle below 90°. The edge has constant lead: its lag angle is tan(helix)/radius × height at all
heights, on the ball and on the flank as on the cylinder (Lee and Altintas, Int. J. Mach. Tools Manuf. 36
(1996) 1059), so that on a ball the local helix falls to nothing towards the tip.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from metro.compiled import compiled
from metro.cutting.cutter import Cutter
from metro.units import Array

# With four points of Gauss-Legendre a panel leaves 5e-6 of an integral that varies as sin² (2 κ) over it, and
# 1e-8 of one that varies as sin² φ.
LARGEST_TURN, LARGEST_LAG = 0.79, 0.4  # of the edge angle and of the lag angle in a panel, rad


class Place(NamedTuple):
    """A place along the meridian.

    Attributes
    ----------
    height, radius : m. sine, cosine : of the edge angle κ between the edge's normal and the tool axis.
    """

    height: float
    radius: float
    sine: float
    cosine: float


class Meridian(NamedTuple):
    """The meridian of a cutter up to a depth, in panels: of the corner first, then of the flank.

    Attributes
    ----------
    corner : its radius, m. inner : where the corner begins, m from the axis.
    helix_cosine, lag_per_depth : of the cutter.
    start, turn : (panels,) edge angle at the lower end, and its growth, rad: 0 on the flank.
    bottom, bottom_radius : (panels,) height and radius at the lower end, m.
    length : (panels,) m.
    """

    corner: float
    inner: float
    helix_cosine: float
    lag_per_depth: float
    start: Array
    turn: Array
    bottom: Array
    bottom_radius: Array
    length: Array


@compiled
def place_at(line: Meridian, panel: int, share: float) -> Place:
    """Return the place at a share (0…1) of a panel."""
    angle = line.start[panel] + line.turn[panel] * share
    sine, cosine = math.sin(angle), math.cos(angle)
    if line.turn[panel] > 0.0:
        return Place(line.corner * (1.0 - cosine), line.inner + line.corner * sine, sine, cosine)
    straight = share * line.length[panel]
    return Place(
        line.bottom[panel] + straight * sine, line.bottom_radius[panel] + straight * cosine, sine, cosine
    )


@compiled
def edge_length(line: Meridian, place: Place) -> float:
    """Length of edge per length of the meridian, times cos(helix): 1 on a cylinder.

    Edge coefficients per axial depth of a cylinder are those per length of edge over cos(helix), so that this
    is what they multiply at every place.
    """
    sideways = place.radius * place.sine * line.lag_per_depth
    return line.helix_cosine * math.sqrt(1.0 + sideways * sideways)


def mean_inclination(cutter: Cutter, depth: float) -> tuple[float, float]:
    """Means of sin κ and cos κ over the height of a cut of a ``depth``, m."""
    line = meridian(cutter, depth, 0.0)
    shares, weights = np.polynomial.legendre.leggauss(4)
    along = across = whole = 0.0
    for panel, length in enumerate(line.length):
        for share, weight in zip(0.5 * (shares + 1.0), weights * length, strict=True):
            place = place_at(line, panel, share)
            height = weight * place.sine
            along, across, whole = along + height * place.sine, across + height * place.cosine, whole + height
    return along / whole, across / whole


def meridian(cutter: Cutter, depth: float, lag: float, feed: float = 0.0) -> Meridian:
    """Return the meridian up to a ``depth``, m, cut into panels for a ``lag``, rad/m.

    On true paths a ``feed`` per tooth, m, apart, a tooth leaves the cut by feed/(2 r) later than half a turn
    after it entered, and lags by lag × z: with the height it leaves ever earlier at first, then ever later.
    The corner is cut where that turns, so that in no panel an edge leaves the cut and comes back to it.
    An edge without a lag leaves ever earlier.
    """
    rc, steepest = cutter.corner, 0.5 * math.pi - cutter.taper
    top = rc * (1.0 - math.cos(steepest))  # where the corner ends
    parts = []
    if rc > 0.0:
        last = steepest if depth >= top else math.acos(1.0 - depth / rc)
        lagging = lag * rc * (1.0 - math.cos(last))
        count = max(math.ceil(last / LARGEST_TURN), math.ceil(lagging / LARGEST_LAG))
        angles = np.linspace(0.0, last, count + 1)
        turning = _turning(cutter, feed / (2.0 * lag)) if feed and lag else last
        if turning < last:
            rest = math.ceil((last - turning) / last * count)
            angles = np.append(0.0, np.linspace(turning, last, rest + 1))
        at = rc * (1.0 - np.cos(angles))
        radius = cutter.radius - rc + rc * np.sin(angles)
        parts.append((angles[:-1], np.diff(angles), at[:-1], radius[:-1], rc * np.diff(angles)))
    if depth > top:
        count = max(1, math.ceil(lag * (depth - top) / LARGEST_LAG))
        at = np.linspace(top, depth, count + 1)
        radius = cutter.radius - rc + rc * math.sin(steepest) + (at - top) / math.tan(steepest)
        even = np.full(count, steepest)
        parts.append((even, 0.0 * even, at[:-1], radius[:-1], np.diff(at) / math.sin(steepest)))
    columns = (np.concatenate(each) for each in zip(*parts, strict=True))
    return Meridian(rc, cutter.radius - rc, math.cos(cutter.helix), cutter.lag_per_depth, *columns)


def _turning(cutter: Cutter, square: float) -> float:
    """Edge angle κ at which radius² × tan κ is ``square``, m²: to first order in κ, by Newton's method."""
    inner, rc, angle = cutter.radius - cutter.corner, cutter.corner, 1.0
    for _ in range(12):
        radius = inner + rc * angle
        angle -= (radius**2 * angle - square) / (radius * (radius + 2.0 * rc * angle))
    return angle
