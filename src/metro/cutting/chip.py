"""Chip thickness: what a tooth finds in front of it, on circular and on true tooth paths."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from metro.cutting.cutter import Cutter
from metro.cutting.engagement import Engagement
from metro.units import Array

ARC_POINTS = 2001
Number = TypeVar("Number", float, Array)


@dataclass(frozen=True)
class Cut:
    """The nominal settings of a cut (SI): what the force over a revolution depends on besides the tool.

    ``curvature`` of the tool's path, 1/m, positive where it turns left (counter-clockwise seen from +z).
    ``pitch``: how far the tool sinks in an orbit of a helix, m; 0 where its path is level. On a helix the
    orbit before has left a floor that is the higher above the tip the farther it is from the hole's axis.
    """

    feed_per_tooth: float
    axial_depth: float
    engagement: Engagement
    curvature: float = 0.0
    pitch: float = 0.0


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
    the two passes (physics.md §2); true paths add :func:`path_excess`, and :func:`curve_excess` on a curve.

    Parameters
    ----------
    immersion : (angles, heights, N) immersion angle of each tooth, rad.
    height : (heights,) m above the tip.
    """
    sine, cosine = np.sin(immersion), np.cos(immersion)
    feed = feed_per_radian(cutter, cut)
    deviation = cutter.radius_deviation(height).T
    curvature = cut.curvature if true_path else 0.0
    passes = cutter.teeth if deviation.any() or curvature else 1
    least = np.full(immersion.shape, np.inf)
    for steps in range(1, passes + 1):
        earlier, pitch = np.roll(deviation, -steps, axis=1), cutter.pitch(steps)
        thickness = (feed * pitch) * sine + (deviation - earlier)
        thickness += curve_excess(curvature, feed * pitch) * cosine
        if true_path:
            thickness += path_excess(feed, pitch, cutter.radius + earlier, sine, cosine)
        np.minimum(least, thickness, out=least)
    return least


def path_excess(feed: float, pitch: Number, radius: Number, sine: Number, cosine: Number) -> Number:
    """Chip between two trochoidal paths less that between the two circles, m.

    The earlier tooth, ``radius`` from the axis and ``pitch`` ahead, crossed the ray of the later one from a
    centre d behind, at an immersion larger by δ: sin δ = d cos φ / radius, d = feed × (pitch − δ), and the
    chip is d sin φ + R_j − radius × cos δ; two iterations are exact to rounding.
    """
    lean = (feed / radius) * cosine
    lean = lean * pitch * (1.0 - lean)
    return lean * ((0.5 * radius) * lean - feed * sine)


def curve_excess(curvature: float, travel: Number) -> Number:
    """Share of cos φ, m, in the chip between two passes on a curve, ``travel`` (m) along it apart.

    The chord between the two centres is turned against the feed by half the angle between them, and a curve
    of radius 1/κ turns by κ × travel: travel sin(φ − κ travel / 2). Towards the centre of the curve the older
    passes have cleared more than the last one.
    """
    return -0.5 * curvature * travel * travel


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
