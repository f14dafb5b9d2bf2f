"""Integrals of what a law makes of the chip, along the engaged edges.

Along a helical edge dz = −dφ/κ, κ the lag per depth: the integral over the height is one over the immersion.
It is taken by Gauss-Legendre quadrature over the pieces of the edge in which one pass bounds the chip: all is
smooth there, so that a few points are exact to rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from metro.cutting.corners import Corner
from metro.cutting.law import EdgeLaw
from metro.cutting.nearby import Edges
from metro.cutting.passes import Passes
from metro.units import Array

TURN = 2.0 * math.pi
# Worst is an arc that begins where the chip does: over a length L, n points leave 4.8e-5 L⁴ (n = 3) and
# 2.2e-7 L⁶ (4) of the integral of sin² φ. Of a quarter of a radian 2 + 4 L points leave 2e-7, 3 + 4 L 5e-11.
LEAST_POINTS, POINTS_PER_RADIAN = 3, 4.0
POINTS_OF_ROOTS = 8  # more, where the law makes roots of the chip's ends


@dataclass(frozen=True, eq=False)
class Pieces:
    """Pieces of edges in the cut, in each of which one pass bounds the chip.

    Attributes
    ----------
    angle : (pieces,) index of the angle of the tool. bounding : (pieces,) of the pass, 0 the last one.
    low, high : (pieces,) immersions at the ends, rad. before : the pass that bounds each, (pieces,).
    depth : what a radian of edge spans, m/rad. partial : pieces in a corner of the work, with the corner.
    """

    angle: npt.NDArray[np.intp]
    bounding: npt.NDArray[np.intp]
    low: Array
    high: Array
    before: Passes
    depth: float
    partial: tuple[tuple[npt.NDArray[np.intp], Corner], ...] = ()

    def chip(self, sine: Array, cosine: Array) -> Array:
        """Chip (…, pieces) at an immersion given by its sine and cosine, m."""
        chip = self.before.chip(sine, cosine)
        for at, corner in self.partial:
            beyond = corner.beyond(sine[..., at], cosine[..., at])
            chip[..., at] = beyond if corner.outer else chip[..., at] - beyond
        return np.maximum(chip, 0.0)


def pieces(before: Passes, bounds: Array, along: Edges, corners: tuple[Corner, ...] = ()) -> Pieces:
    """Cut the engaged part of each edge where the pass that bounds its chip changes.

    Parameters
    ----------
    bounds : (bounds, angles or 1, N or 1) of :func:`metro.cutting.arcs.arcs`, rad. along : the edges.
    corners : of the work, where the bounds allow for them.
    """
    low, high = bounds[:-1], bounds[1:]
    start = low[0].min()
    leading = start + np.mod(along.top - start, TURN)
    parts = []
    for turn in range(math.ceil((high.max() - start + along.span) / TURN)):
        upper = np.minimum(high, leading + TURN * turn)
        lower = np.maximum(low, leading + (TURN * turn - along.span))
        at = np.nonzero(upper > lower)
        parts.append((at[1], at[2], lower[at], upper[at]))
    angle, tooth, lower, upper = (np.concatenate(part) for part in zip(*parts, strict=True))
    passed = before.before(angle, tooth)
    middle = 0.5 * (lower + upper)
    bounding = passed.chip(np.sin(middle), np.cos(middle)).argmin(axis=0)
    partial = []
    for corner in corners:
        vanishing, whole = corner.at(angle, tooth).limits
        (inside,) = np.nonzero((middle - vanishing) * (middle - whole) < 0.0)
        partial.append((inside, corner.at(angle[inside], tooth[inside])))
    bounded = passed[bounding, np.arange(len(angle))]
    return Pieces(angle, bounding, lower, upper, bounded, along.depth, tuple(partial))


def points(cut: Pieces, law: EdgeLaw) -> tuple[Array, Array]:
    """Immersions (points, pieces), rad, and weights (points,) of a quadrature along each piece."""
    length = cut.high - cut.low
    count = LEAST_POINTS + math.ceil(POINTS_PER_RADIAN * length.max(initial=0.0))
    places, weights = rule(count, is_linear(law, cut.before.feed))
    return cut.low + places[:, None] * length, weights


def integrated(cut: Pieces, law: EdgeLaw, angles: int) -> Array:
    """Integrals (angles, 6) m of shear × sin φ, shear × cos φ, shear, sin φ, cos φ, 1, summed over teeth."""
    phi, weights = points(cut, law)
    sine, cosine = np.sin(phi), np.cos(phi)
    shear = law.shear(cut.chip(sine, cosine))
    parts = [weights @ wave for wave in (shear * sine, shear * cosine, shear, sine, cosine)]
    depths = np.stack([*parts, np.ones(len(cut.angle))]) * (cut.depth * (cut.high - cut.low))
    return np.stack([np.bincount(cut.angle, part, angles) for part in depths], axis=1)


def is_linear(law: EdgeLaw, thickness: float) -> bool:
    """Whether the law's shear is the thickness itself: asked of it, for an effect may have replaced it."""
    some = np.linspace(0.0, thickness, 5)
    return bool(np.all(law.shear(some) == some))


@lru_cache(maxsize=64)
def rule(count: int, linear: bool) -> tuple[Array, Array]:
    """Points and weights (count,) of a quadrature over 0…1.

    Gauss-Legendre; for laws that are not linear in w, t = w² (3 − 2w): the root of the distance from the end,
    which a power of the chip makes, is smooth in w.
    """
    nodes, weights = np.polynomial.legendre.leggauss(count if linear else count + POINTS_OF_ROOTS)
    points, weights = 0.5 * (nodes + 1.0), 0.5 * weights
    if linear:
        return points, weights
    return points**2 * (3.0 - 2.0 * points), weights * 6.0 * points * (1.0 - points)
