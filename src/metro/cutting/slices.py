"""Integrals along the engaged edge by slices: for chips that depend on the height as well.

That is runout on true tooth paths, or under a law that is not linear.
"""

from __future__ import annotations

import math

import numpy as np

from metro.cutting.chip import Cut, chip_thickness
from metro.cutting.cutter import Cutter
from metro.cutting.engagement import Engagement
from metro.cutting.law import EdgeLaw
from metro.units import Array

SLICES_PER_RADIAN = 60
OPENING = 0.3
POINTS_AT_ONCE = 6000  # what a processor's cache holds


def sliced(
    cutter: Cutter,
    law: EdgeLaw,
    cut: Cut,
    *,
    true_path: bool,
    angle: Array,
    per_radian: float = SLICES_PER_RADIAN,
) -> Array:
    """Integrals (angles, 6) m over the edges of shear × sin φ, shear × cos φ, shear, sin φ, cos φ, 1.

    Parameters
    ----------
    angle : of tooth 0, even over the revolution, rad. per_radian : slices per radian of lag, at least four.
    """
    lag = abs(cutter.lag_per_depth * cut.axial_depth)
    count = max(4, math.ceil(per_radian * lag))
    height = (np.arange(count) + 0.5) * cut.axial_depth / count
    window = max(2.0 * math.pi / len(angle), lag / count)
    parts = math.ceil(len(angle) * count * cutter.teeth / POINTS_AT_ONCE)
    sums = [
        _summed(cutter, law, cut, true_path=true_path, angle=part, height=height, window=window)
        for part in np.array_split(angle, parts)
    ]
    return np.concatenate(sums) * (cut.axial_depth / count)


def _summed(
    cutter: Cutter,
    law: EdgeLaw,
    cut: Cut,
    *,
    true_path: bool,
    angle: Array,
    height: Array,
    window: float,
) -> Array:
    """Sum (angles, 6) over slices and teeth, each slice counting by its share in the cut."""
    teeth = np.asarray(cutter.tooth_angles)
    immersion = angle[:, None, None] + (teeth - cutter.lag_per_depth * height[:, None])
    engaged = _opened(cut.engagement) if true_path else cut.engagement
    covered, immersion = _covered(immersion, engaged, window)
    thickness = chip_thickness(cutter, cut, immersion, height, true_path)
    sine, cosine = np.sin(immersion), np.cos(immersion)
    # Neighbours in height tell the slope, runout included; an edge that hardly lags turns with its runout.
    helical = window < 1.001 * abs(cutter.lag_per_depth) * (height[1] - height[0])
    change = np.gradient(thickness, axis=1) if helical else cut.feed_per_tooth * cosine * window
    edge = covered * _positive_share(thickness, change * covered)
    shear = edge * law.shear(np.maximum(thickness, 0.0))
    weighted = [weight * wave for weight in (shear, edge) for wave in (sine, cosine, 1.0)]
    return np.stack([part.sum(axis=(1, 2)) for part in weighted], axis=1)


def _opened(engaged: Engagement) -> Engagement:
    """Let the chip thickness alone decide where a tooth enters or leaves along the feed.

    There the thickness goes through zero, and on the true path it does so a little outside 0…π.
    """
    entry = engaged.entry - OPENING if engaged.entry == 0.0 else engaged.entry
    return Engagement(entry, engaged.exit + OPENING if engaged.exit == math.pi else engaged.exit)


def _positive_share(thickness: Array, change: Array) -> Array:
    """Share of the window around each point in which the thickness, taken as linear there, is positive.

    ``change`` is that of the thickness over the engaged part of the window.
    """
    return np.clip(thickness / np.maximum(np.abs(change), 1e-15) + 0.5, 0.0, 1.0)


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
