"""Integrals of what a law makes of the chip, along the pieces of edges.

Along a helical edge dz = −dφ/κ, κ the lag per depth: the integral over the height is one over the immersion.
It is taken by Gauss-Legendre quadrature over the pieces in which one pass bounds the chip: all is smooth
there, so that a few points are exact to rounding.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from metro.compiled import compiled_with_arrays
from metro.cutting.edges import HIGH, LOW, Pieces, chip_of, piece_of
from metro.cutting.law import EdgeLaw
from metro.units import Array

# Worst is an arc that begins where the chip does: over a length L, n points leave 4.8e-5 L⁴ (n = 3) and
# 2.2e-7 L⁶ (4) of the integral of sin² φ. Of a quarter of a radian 2 + 4 L points leave 2e-7, 3 + 4 L 5e-11.
LEAST_POINTS, POINTS_PER_RADIAN = 3, 4.0
POINTS_OF_ROOTS = 8  # more, where the law makes roots of the chip's ends
WHOLE = np.array([0.0, 1.0])


class Points(NamedTuple):
    """Points along pieces, arrays (pieces, points): sine and cosine of the immersion, and the chip, m.

    ``weights`` (points,) of a quadrature over each piece.
    """

    sine: Array
    cosine: Array
    chip: Array
    weights: Array


def points(cut: Pieces, law: EdgeLaw) -> Points:
    """Return the points of a quadrature along each piece."""
    count = LEAST_POINTS + math.ceil(POINTS_PER_RADIAN * cut.length.max(initial=0.0))
    return _along(cut, *rule(count, is_linear(law, cut.scale.feed)))


def ends(cut: Pieces) -> Points:
    """Return where pieces begin and end, (pieces, 2)."""
    return _along(cut, WHOLE, np.zeros(2))


@compiled_with_arrays
def _along(cut: Pieces, places: Array, weights: Array) -> Points:
    bounds, sine = cut.bounds, np.empty((len(cut.bounds), len(places)))
    cosine, chip = np.empty_like(sine), np.empty_like(sine)
    for i in range(len(sine)):
        piece = piece_of(cut, i)
        for k in range(len(places)):
            phi = bounds[i, LOW] + places[k] * (bounds[i, HIGH] - bounds[i, LOW])
            s, c = math.sin(phi), math.cos(phi)
            sine[i, k], cosine[i, k] = s, c
            chip[i, k] = chip_of(cut.scale, piece, s, c)
    return Points(sine, cosine, chip, weights)


def assembled(cut: Pieces, law: EdgeLaw, angles: int) -> Array:
    """Force on the tool per unit of each coefficient, (angles, 3, 6), of pieces of edges (physics.md §2)."""
    return of_points(cut, points(cut, law), law, angles)


def of_points(cut: Pieces, along: Points, law: EdgeLaw, angles: int) -> Array:
    """Force as of :func:`assembled` of pieces whose quadrature is known."""
    return _summed(cut, along, law.shear(along.chip), angles)


@compiled_with_arrays
def _summed(cut: Pieces, along: Points, shear: Array, angles: int) -> Array:
    """Force per unit of each coefficient: shear in the first three columns, edge in the others."""
    angle, bounds, sine, cosine, weights = cut.angle, cut.bounds, along.sine, along.cosine, along.weights
    basis = np.zeros((angles, 3, 6))
    for i in range(len(angle)):
        at, length = basis[angle[i]], cut.depth * (bounds[i, HIGH] - bounds[i, LOW])
        for k in range(len(weights)):
            edge = weights[k] * length
            for column, size in ((0, edge * shear[i, k]), (3, edge)):
                ahead, aside = size * sine[i, k], size * cosine[i, k]
                at[0, column] -= aside
                at[1, column] += ahead
                at[0, column + 1] -= ahead
                at[1, column + 1] -= aside
                at[2, column + 2] += size
    return basis


@lru_cache(maxsize=512)
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
