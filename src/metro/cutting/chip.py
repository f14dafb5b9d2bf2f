"""Chip thickness: what a tooth finds in front of it, on circular and on true tooth paths."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from metro.cutting.cutter import Cutter
from metro.cutting.engagement import Engagement
from metro.units import Array

ARC_POINTS = 2001


@dataclass(frozen=True)
class Cut:
    """The nominal settings of a cut (SI): what the force over a revolution depends on besides the tool."""

    feed_per_tooth: float
    axial_depth: float
    engagement: Engagement


@dataclass(frozen=True)
class PathDifference:
    """True chip thickness less feed × sine of the immersion, over the arc and all teeth: m."""

    largest: float
    rms: float


def feed_per_radian(cutter: Cutter, cut: Cut) -> float:
    """Feed while the tool turns by one radian, m/rad."""
    return cut.feed_per_tooth * cutter.teeth / (2.0 * math.pi)


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
    feed = feed_per_radian(cutter, cut)
    deviation = cutter.radius_deviation(height).T
    passes = cutter.teeth if cutter.runout_radius > 0.0 else 1
    least = np.full(immersion.shape, np.inf)
    for steps in range(1, passes + 1):
        earlier = np.roll(deviation, -steps, axis=1)
        pitch, radius = cutter.pitch(steps), cutter.radius + earlier
        thickness = (feed * pitch) * sine + (deviation - earlier)
        if true_path:
            lean = (feed / radius) * cosine
            lean = lean * pitch * (1.0 - lean)
            thickness += lean * ((0.5 * radius) * lean - feed * sine)
        np.minimum(least, thickness, out=least)
    return least


def path_difference(cutter: Cutter, cut: Cut) -> PathDifference:
    """How far the chip of the true tooth paths is from feed × sin φ over the arc of the cut.

    Of the tool without runout, which would add the same to both.
    """
    round_tool = replace(cutter, runout_radius=0.0)
    phi = np.linspace(cut.engagement.entry, cut.engagement.exit, ARC_POINTS)
    immersion = np.repeat(phi[:, None, None], cutter.teeth, axis=2)
    true, circular = (chip_thickness(round_tool, cut, immersion, np.zeros(1), path) for path in (True, False))
    difference = true - circular
    return PathDifference(float(np.abs(difference).max()), float(np.sqrt(np.mean(difference**2))))
