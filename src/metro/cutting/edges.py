"""Integrals of what a law makes of the chip, along the engaged edges.

Along a helical edge dz = −dφ/κ, κ the lag per depth: the integral over the height is one over the immersion.
It is taken by Gauss-Legendre quadrature over the pieces of the edge in which one pass bounds the chip: all is
smooth there, so that a few points are exact to rounding.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from metro.cutting.law import EdgeLaw
from metro.cutting.passes import Passes
from metro.units import Array

TURN = 2.0 * math.pi
LEAST_POINTS, POINTS_PER_RADIAN = 2, 4.0
POINTS_OF_ROOTS = 8  # more, where the law makes roots of the chip's ends


def integrated(before: Passes, bounds: Array, law: EdgeLaw, top: Array, span: float) -> Array:
    """Integrals (angles, 6) rad of shear × sin φ, shear × cos φ, shear, sin φ, cos φ, 1, summed over teeth.

    Parameters
    ----------
    bounds : (bounds, angles or 1, N or 1) of :func:`metro.cutting.arcs.arcs`, rad.
    top : (angles, N) immersion of the leading end of each edge, rad. span : what an edge spans, > 0, rad.
    """
    low, high = bounds[:-1], bounds[1:]
    start = low[0].min()
    leading = start + np.mod(top - start, TURN)
    linear = _is_linear(law, before.feed)
    sums = np.zeros((6, len(top)))
    for turn in range(math.ceil((high.max() - start + span) / TURN)):
        upper = np.minimum(high, leading + TURN * turn)
        lower = np.maximum(low, leading + (TURN * turn - span))
        at = np.nonzero(upper > lower)
        if not at[0].size:
            continue
        _, angle, tooth = at
        parts = _quadrature(before.before(angle, tooth), law, linear, lower[at], upper[at])
        sums += np.stack([np.bincount(angle, part, len(top)) for part in parts])
    return sums.T


def _quadrature(before: Passes, law: EdgeLaw, linear: bool, low: Array, high: Array) -> Array:
    """Integrals (6, pieces) over pieces of edges; ``before`` is (passes, pieces)."""
    length, middle = high - low, 0.5 * (low + high)
    points, weights = rule(LEAST_POINTS + math.ceil(POINTS_PER_RADIAN * length.max()), linear)
    bounding = before.chip(np.sin(middle), np.cos(middle)).argmin(axis=0)
    before = before[bounding, np.arange(len(low))]
    phi = low + points[:, None] * length
    sine, cosine = np.sin(phi), np.cos(phi)
    shear = law.shear(np.maximum(before.chip(sine, cosine), 0.0))
    parts = [weights @ values for values in (shear * sine, shear * cosine, shear, sine, cosine)]
    return np.stack([*parts, np.ones(len(low))]) * length


def _is_linear(law: EdgeLaw, thickness: float) -> bool:
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
