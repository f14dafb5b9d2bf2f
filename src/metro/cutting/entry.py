"""The cutter going into a block and out of it: which part of the arc is inside, and the forces there.

The block's faces are square to the feed, ``travel`` is how far the cutter's axis is beyond the face, m: a
point of the rim at immersion φ is inside while it enters where travel + R sin φ > 0, and while it leaves
where travel + R sin φ < 0. The face is taken to cut a tooth's arc short, not to thin its chip: that is the
case over the last feed per tooth only.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter
from metro.cutting.engagement import Engagement
from metro.cutting.force import ANGLES, force_basis
from metro.cutting.law import EdgeLaw
from metro.units import Array


def entering(whole: Engagement, radius: float, travel: float) -> tuple[Engagement, ...]:
    """Parts of the arc ``whole`` inside a block that begins ``travel`` m behind the axis: none or one."""
    half = _chord(radius, travel)
    return _parts(whole, [(half, math.pi - half)])


def leaving(whole: Engagement, radius: float, travel: float) -> tuple[Engagement, ...]:
    """Parts of the arc ``whole`` inside a block that ends ``travel`` m behind the axis: none, one or two."""
    half = _chord(radius, travel)
    return _parts(whole, [(0.0, half), (math.pi - half, math.pi)])


def entry_basis(cutter: Cutter, law: EdgeLaw, cut: Cut, travel: float, true_path: bool = False) -> Array:
    """Force per unit of each coefficient, (ANGLES, 3, 6) as of ``force_basis``, going into the block."""
    return _summed(cutter, law, cut, entering(cut.engagement, cutter.radius, travel), true_path)


def exit_basis(cutter: Cutter, law: EdgeLaw, cut: Cut, travel: float, true_path: bool = False) -> Array:
    """Force per unit of each coefficient, (ANGLES, 3, 6) as of ``force_basis``, going out of the block."""
    return _summed(cutter, law, cut, leaving(cut.engagement, cutter.radius, travel), true_path)


def _chord(radius: float, travel: float) -> float:
    """Immersion, 0…π/2, at which the rim's front crosses the face."""
    return math.asin(min(1.0, max(0.0, -travel / radius)))


def _parts(whole: Engagement, inside: list[tuple[float, float]]) -> tuple[Engagement, ...]:
    """Intersect ``whole`` with intervals; intervals that touch are one."""
    if len(inside) == 2 and inside[0][1] >= inside[1][0]:
        return (whole,)
    return tuple(
        Engagement(max(whole.entry, low), min(whole.exit, high), low > whole.entry, high < whole.exit)
        for low, high in inside
        if min(whole.exit, high) > max(whole.entry, low)
    )


def _summed(cutter: Cutter, law: EdgeLaw, cut: Cut, parts: tuple[Engagement, ...], true_path: bool) -> Array:
    basis = np.zeros((ANGLES, 3, 6))
    for part in parts:
        basis += force_basis(cutter, law, replace(cut, engagement=part), true_path)
    return basis
