"""Cutting forces over a revolution, as a linear function of the cutting coefficients."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from metro.cutting.cutter import Cutter
from metro.cutting.engagement import Engagement
from metro.cutting.law import EdgeLaw
from metro.units import Array

COEFFICIENTS = ("ktc", "krc", "kac", "kte", "kre", "kae")
ANGLES = 720
SLICES_PER_RADIAN = 60
OPENING = 0.3


@dataclass(frozen=True)
class Cut:
    """The nominal settings of a cut (SI): what the force over a revolution depends on besides the tool."""

    feed_per_tooth: float
    axial_depth: float
    engagement: Engagement


def chip_thickness(cutter: Cutter, cut: Cut, immersion: Array, height: Array, true_path: bool) -> Array:
    """Chip thickness of every tooth, (angles, heights, N) m; negative where the tooth is clear of the work.

    A tooth clears what the teeth before it left, and some of those may have left more than the last one: the
    least over m = 1…N counts. On circular paths h_m = s_m sin φ + R_j − R_{j+m}, with s_m the feed between
    the two passes (physics.md §2). On the true, trochoidal paths tooth j+m crossed the ray of tooth j from a
    centre d behind, at an immersion larger by δ: sin δ = d cos φ / R_{j+m}, d = (v/ω)(pitch − δ), h_m = d sin
    φ + R_j − R_{j+m} cos δ; two iterations are exact to rounding.

    Parameters
    ----------
    immersion : (angles, heights, N) immersion angle of each tooth, rad.
    height : (heights,) m above the tip.
    """
    sine, cosine = np.sin(immersion), np.cos(immersion)
    feed_per_radian = cut.feed_per_tooth * cutter.teeth / (2.0 * math.pi)
    deviation = cutter.radius_deviation(height).T
    passes = cutter.teeth if cutter.runout_radius > 0.0 else 1
    least = np.full(immersion.shape, np.inf)
    for steps in range(1, passes + 1):
        earlier = np.roll(deviation, -steps, axis=1)
        travel = feed_per_radian * cutter.pitch(steps)
        thickness = travel * sine + deviation - earlier
        if true_path:
            lean = travel * cosine / (cutter.radius + earlier)
            lean = feed_per_radian * (cutter.pitch(steps) - lean) * cosine / (cutter.radius + earlier)
            thickness += -feed_per_radian * lean * sine + (cutter.radius + earlier) * 0.5 * lean**2
        np.minimum(least, thickness, out=least)
    return least


@lru_cache(maxsize=4096)
def force_basis(cutter: Cutter, law: EdgeLaw, cut: Cut, true_path: bool = False) -> Array:
    """Force on the tool per unit of each coefficient over one revolution, feed frame.

    Returns
    -------
    (ANGLES, 3, 6) array: angle of tooth 0's tip from +y, evenly from 0 to 2π; axis; coefficient in the order
    of ``COEFFICIENTS`` (shear in N per N/m², edge in N per N/m of axial depth). Read-only: it is cached.
    """
    lag = cutter.lag_per_depth * cut.axial_depth
    slices = max(4, math.ceil(SLICES_PER_RADIAN * lag))
    height = (np.arange(slices) + 0.5) * cut.axial_depth / slices
    angle = 2.0 * math.pi * np.arange(ANGLES) / ANGLES
    teeth = np.asarray(cutter.tooth_angles)
    immersion = angle[:, None, None] - cutter.lag_per_depth * height[None, :, None] + teeth
    engaged = _opened(cut.engagement) if true_path else cut.engagement
    window = max(2.0 * math.pi / ANGLES, lag / slices)
    covered, immersion = _covered(immersion, engaged, window)
    thickness = chip_thickness(cutter, cut, immersion, height, true_path)
    inside = covered * _positive_share(thickness, cut.feed_per_tooth * np.cos(immersion) * covered * window)
    dz = cut.axial_depth / slices
    shear, edge = inside * law.shear(np.maximum(thickness, 0.0)) * dz, inside * dz
    sine, cosine = np.sin(immersion), np.cos(immersion)
    basis = np.zeros((ANGLES, 3, 6))
    for column, weight in ((0, shear), (3, edge)):
        along_sine, along_cosine = (weight * sine).sum((1, 2)), (weight * cosine).sum((1, 2))
        basis[:, 0, column], basis[:, 1, column] = -along_cosine, along_sine
        basis[:, 0, column + 1], basis[:, 1, column + 1] = -along_sine, -along_cosine
        basis[:, 2, column + 2] = weight.sum((1, 2))
    basis.flags.writeable = False
    return basis


def _opened(engaged: Engagement) -> Engagement:
    """Let the chip thickness alone decide where a tooth enters or leaves along the feed.

    There the thickness goes through zero, and on the true path it does so a little outside 0…π.
    """
    entry = engaged.entry - OPENING if engaged.entry == 0.0 else engaged.entry
    return Engagement(entry, engaged.exit + OPENING if engaged.exit == math.pi else engaged.exit)


def _positive_share(thickness: Array, slope: Array) -> Array:
    """Share of the window around each point in which the thickness, taken as linear there, is positive.

    ``slope`` is the change of the thickness over the engaged part of the window.
    """
    return np.clip(thickness / np.maximum(np.abs(slope), 1e-15) + 0.5, 0.0, 1.0)


def _covered(immersion: Array, engaged: Engagement, window: float) -> tuple[Array, Array]:
    """Share of the window around each immersion angle that is engaged, and the middle of that share.

    The window is what a slice spans by its helix: so the edge is integrated over its height, not sampled. An
    edge without helix enters between two grid points: there the window is the angular step, which keeps the
    mean over a revolution exact to second order.
    """
    middle = 0.5 * (engaged.entry + engaged.exit)
    offset = np.mod(immersion - middle + math.pi, 2.0 * math.pi) - math.pi
    half = 0.5 * (engaged.exit - engaged.entry)
    low, high = np.maximum(offset - window / 2, -half), np.minimum(offset + window / 2, half)
    return np.maximum(0.0, high - low) / window, middle + 0.5 * (low + high)


def mean_force(cutter: Cutter, law: EdgeLaw, cut: Cut, coefficients: Array) -> Array:
    """Mean force on the tool over a revolution, (3,) N, feed frame; ``coefficients`` (6,) SI."""
    return np.asarray(force_basis(cutter, law, cut).mean(axis=0) @ coefficients)
