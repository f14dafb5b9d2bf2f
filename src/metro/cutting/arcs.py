"""Integrals along the engaged edge, exact: the chip thickness as a function of the immersion alone.

Along a helical edge dz = −dφ/κ, κ the lag per depth, so the integral over the height is one over the
immersion, and that is the difference of an antiderivative at its two ends. At one angle of the tool even
runout keeps the chip of circular paths a sinusoid of the immersion: κz = θ + α_j − φ turns R_j(z) into
ρ cos(λ + θ − φ). Of the passes that may bound the chip the least counts: for 0 < φ < π each is sin φ times
a straight line in cot φ, and the least of straight lines is concave, so every pass bounds the chip in one
piece of the arc at most.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from metro.cutting.chip import Cut, chip_thickness, feed_per_radian
from metro.cutting.cutter import Cutter
from metro.cutting.law import EdgeLaw
from metro.units import Array

TURN = 2.0 * math.pi
KNOTS = 1025
ROOT_STEPS = 8
Index = tuple[npt.NDArray[np.intp], ...]


@dataclass(frozen=True)
class Arcs:
    """Pieces of the arc in which the teeth cut, and the antiderivatives of what is summed along the edge.

    Attributes
    ----------
    low, high : immersion at the ends of each piece, (angles or 1, N, pieces) rad; empty where high ≤ low.
    integral : from immersions (n,) and their index (angle, tooth, piece) to the antiderivatives, (n, 6), of
        shear × sin φ, shear × cos φ, shear, sin φ, cos φ, 1.
    """

    low: Array
    high: Array
    integral: Callable[[Array, Index], Array]


def arcs(cutter: Cutter, law: EdgeLaw, cut: Cut, true_path: bool, angle: Array) -> Arcs | None:
    """Pieces of the arc at angles (n,) of tooth 0; None where they have no antiderivative: use slices then.

    That is with runout on true paths, or under a law that is not linear.
    """
    linear = _is_linear(law, cut) and not true_path
    if cutter.runout_radius > 0.0:
        return _with_runout(cutter, cut, angle) if linear else None
    if not linear:
        return _tabulated(cutter, law, cut, true_path)
    travel = feed_per_radian(cutter, cut) * cutter.pitch(1)[None, :, None]
    low, high = max(cut.engagement.entry, 0.0), min(cut.engagement.exit, math.pi)
    return Arcs(
        np.full(travel.shape, low), np.full(travel.shape, high), _sinusoid(travel, np.zeros(travel.shape))
    )


def integrated(pieces: Arcs, top: Array, span: float) -> Array:
    """Integrals over the edges, (angles, 6) rad (shear: its unit × rad), summed over teeth.

    Parameters
    ----------
    top : (angles, N) immersion of the leading end of each edge, rad. span : what an edge spans, > 0, rad.
    """
    sums = np.zeros((len(top), 6))
    leading = np.mod(top, TURN)[:, :, None]
    for turn in range(math.ceil(span / TURN) + 1):
        high = np.minimum(pieces.high, leading + TURN * turn)
        low = np.maximum(pieces.low, leading + TURN * turn - span)
        at = np.nonzero(high > low)
        parts = pieces.integral(high[at], at) - pieces.integral(low[at], at)
        for column in range(6):
            sums[:, column] += np.bincount(at[0], parts[:, column], len(top))
    return sums


def over_arc(pieces: Arcs) -> Array:
    """Integrals (6,) over the whole arc, summed over teeth; of pieces that are those of every angle."""
    at = np.nonzero(pieces.high > pieces.low)
    parts = pieces.integral(pieces.high[at], at) - pieces.integral(pieces.low[at], at)
    return np.asarray(parts.sum(axis=0))


def _is_linear(law: EdgeLaw, cut: Cut) -> bool:
    """Whether the law's shear is the thickness itself: asked of it, for an effect may have replaced it."""
    thickness = np.linspace(0.0, cut.feed_per_tooth, 5)
    return bool(np.all(law.shear(thickness) == thickness))


def _sinusoid(along_sine: Array, along_cosine: Array) -> Callable[[Array, Index], Array]:
    """Antiderivatives for the chip A sin φ + B cos φ, with A and B by (angle or 1, N, piece)."""

    def integral(phi: Array, at: Index) -> Array:
        where = (at[0] if len(along_sine) > 1 else np.zeros_like(at[0]), *at[1:])
        a, b = along_sine[where], along_cosine[where]
        sine, cosine = np.sin(phi), np.cos(phi)
        square, product = 0.5 * sine**2, 0.5 * sine * cosine
        return np.column_stack(
            [
                a * (0.5 * phi - product) + b * square,
                a * square + b * (0.5 * phi + product),
                b * sine - a * cosine,
                -cosine,
                sine,
                phi,
            ]
        )

    return integral


def _with_runout(cutter: Cutter, cut: Cut, angle: Array) -> Arcs:
    """Pieces of circular paths with runout: which of the passes m = 1…N bounds the chip, and where."""
    pitch = np.stack([cutter.pitch(m) for m in range(1, cutter.teeth + 1)], axis=1)
    own = (cutter.runout_angle + angle)[:, None, None]
    a = feed_per_radian(cutter, cut) * pitch + cutter.runout_radius * (np.sin(own) - np.sin(own - pitch))
    b = cutter.runout_radius * (np.cos(own) - np.cos(own - pitch))
    # Pass m is the least where a_m + b_m cot φ is below every other line, and it cuts where that is positive.
    least, most = np.full(a.shape, -np.inf), np.full(a.shape, np.inf)
    for other in range(cutter.teeth):
        others = np.arange(cutter.teeth) != other
        _bound(a - a[..., [other]], b - b[..., [other]], least, most, others)
    _bound(-a, -b, least, most, np.full(cutter.teeth, True))
    low = np.maximum(np.arctan2(1.0, most), max(cut.engagement.entry, 0.0))
    high = np.minimum(np.arctan2(1.0, least), min(cut.engagement.exit, math.pi))
    return Arcs(low, high, _sinusoid(a, b))


def _bound(level: Array, slope: Array, least: Array, most: Array, among: npt.NDArray[np.bool_]) -> None:
    """Narrow ``least`` and ``most``, in place, to where level + slope × cot φ < 0; last axis ``among``."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        crossing = -level / (slope + 0.0)
    rising = slope >= 0.0
    np.fmin(most, crossing, out=most, where=rising & among)
    np.fmax(least, crossing, out=least, where=~rising & among)


def _tabulated(cutter: Cutter, law: EdgeLaw, cut: Cut, true_path: bool) -> Arcs:
    """Any law, and true paths: the antiderivative of a cubic spline in u, φ = middle − half × cos u.

    The cosine makes the ends of the arc smooth, where a power law has a root of the immersion: the integrals
    are exact to 1e-11 of the arc's.
    """
    low, high = _ends(cutter, cut, true_path)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    u = np.linspace(0.0, math.pi, KNOTS)
    phi = middle - half * np.cos(u)[:, None]
    thickness = chip_thickness(cutter, cut, phi[:, None, :], np.zeros(1), true_path)[:, 0, :]
    weight = law.shear(np.maximum(thickness, 0.0)) * half * np.sin(u)[:, None]
    table = _primitive(u, np.stack([weight * np.sin(phi), weight * np.cos(phi), weight], axis=2))

    def integral(phi: Array, at: Index) -> Array:
        tooth = at[1]
        position = np.arccos(np.clip((middle[tooth] - phi) / half[tooth], -1.0, 1.0))
        return np.column_stack([table(position, tooth), -np.cos(phi), np.sin(phi), phi])

    return Arcs(low[None, :, None], high[None, :, None], integral)


def _primitive(u: Array, values: Array) -> Callable[[Array, npt.NDArray[np.intp]], Array]:
    """Antiderivative of (knots, N, 3) samples: a function of positions (n,) and teeth (n,)."""
    from scipy.interpolate import CubicSpline

    splines = [CubicSpline(u, values[:, tooth]).antiderivative() for tooth in range(values.shape[1])]

    def evaluate(position: Array, tooth: npt.NDArray[np.intp]) -> Array:
        result = np.empty((len(position), values.shape[2]))
        for j, spline in enumerate(splines):
            result[tooth == j] = spline(position[tooth == j])
        return result

    return evaluate


def _ends(cutter: Cutter, cut: Cut, true_path: bool) -> tuple[Array, Array]:
    """Immersion at which each tooth starts and stops cutting, (N,) rad.

    Along the feed it is the chip that begins and ends there: on true paths a little outside 0…π.
    """
    low = np.full(cutter.teeth, max(cut.engagement.entry, 0.0))
    high = np.full(cutter.teeth, min(cut.engagement.exit, math.pi))
    if true_path and cut.engagement.entry <= 0.0:
        low = _root(cutter, cut, low)
    if true_path and cut.engagement.exit >= math.pi:
        high = _root(cutter, cut, high)
    return low, high


def _root(cutter: Cutter, cut: Cut, start: Array) -> Array:
    """Immersion (N,) near ``start`` where the chip of true paths vanishes.

    The slope is that of circular paths: every step gains a factor feed/radius.
    """
    travel = feed_per_radian(cutter, cut) * cutter.pitch(1)
    phi = start
    for _ in range(ROOT_STEPS):
        thickness = chip_thickness(cutter, cut, phi[None, None, :], np.zeros(1), true_path=True)[0, 0]
        phi = phi - thickness / (travel * np.cos(phi))
    return phi
