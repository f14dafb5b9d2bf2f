"""Orders of the force on a general cutter, by a quadrature over the arc in which each of its teeth cuts.

A table over even angles of the spindle samples the force where it happens to be. Where a tooth enters at a
raw edge its force begins as the root of how far it is in, and as a parameter moves that past a sample, the
orders jump: by a thousandth of the force, which is as much as a tenth of a standard deviation of what is
fitted, and steps of a descent no longer gain. Here the nodes move with the ends of the arc of each tooth, and
crowd there, as in Sidi's transformation (Int. Ser. Numer. Math. 112 (1993) 359), so that all is as smooth as
the force itself.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from metro.cutting.arcs import TURN
from metro.cutting.chip import Cut, feed_per_radian
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.edges import Edges
from metro.cutting.floor import floor_of
from metro.cutting.general import General, forces, in_cut
from metro.cutting.general_teeth import Teeth
from metro.cutting.law import EdgeLaw
from metro.cutting.passes import ALIKE
from metro.units import Array, ComplexArray

# Per degree of an arc: as dear as a table of 360 angles. Orders up to the 48th have an error of 1.5e-3 of the
# force (rms) at most, 2.5e-3 without a helix (the table: 7e-3, 1.6e-2); 16 per degree leave below 2.5e-4.
NODES = 0.75
CROWDED = 0.15  # share of the nodes that crowd at either end
PER_ORDER = 4.0  # nodes, at least, per period of the highest order in the arc


def general_orders(cutter: Cutter, law: EdgeLaw, cut: Cut, highest: int, *, true_path: bool) -> ComplexArray:
    """Amplitudes (highest + 1, 3, 6) of the orders of the force per unit of each coefficient, feed frame.

    As of :func:`metro.signals.orders.amplitudes`; on a level path.
    """
    waves = np.zeros((highest + 1, 3, 6), complex)
    if cut.axial_depth <= 0.0:
        return waves
    lag = cutter.lag_per_depth * cut.axial_depth
    span = abs(lag)
    general = in_cut(cutter, law, cut, span / cut.axial_depth, true_path=true_path)
    low, high = _arcs(cutter, general, span)
    even = bool(np.ptp(cutter.pitch(1)) < ALIKE and not cutter.runout_radius and not any(cutter.reach))
    count = 1 if even else cutter.teeth
    if float((high - low)[:count].max()) <= 0.0:
        return waves
    good = replace(
        cutter,
        tooth_angles=evenly_pitched(cutter.teeth),
        runout_radius=0.0,
        runout_angle=0.0,
        reach=(),
        corner=round(cutter.corner / cutter.radius) * cutter.radius,
    )
    longest = _longest_arc(good, law, cut, true_path=true_path)
    place, weight = _crowded(math.ceil(max(NODES * 360.0, PER_ORDER * highest) * longest / TURN))
    arc = np.maximum(high - low, 0.0)[:count]
    top, weight = low[:count] + arc * place[:, None], arc * weight[:, None]
    depth = cut.axial_depth / span if span else math.inf
    found = forces(general, law, Edges(top, span, depth, lag >= 0.0, floor_of(cutter, cut)))
    each = _powers(-top, highest) * (weight / TURN)
    # A tooth leads tooth 0 by its angle, and its leading end is at the tip or at the top.
    phase = _powers(np.asarray(cutter.tooth_angles) + 0.5 * (span - lag), highest)
    each *= (phase.sum(axis=1, keepdims=True) if even else phase)[:, None]
    each, found = each.reshape(highest + 1, -1), found.reshape(-1, 18)
    waves += (each.real @ found + 1j * (each.imag @ found)).reshape(waves.shape)
    waves[1:] *= math.sqrt(2.0)
    return waves


@lru_cache(maxsize=1024)
def _longest_arc(good: Cutter, law: EdgeLaw, cut: Cut, *, true_path: bool) -> float:
    """Return the immersion, rad, for which teeth have nodes: by a ``good`` tool with a flat or a ball end.

    Were it that of the arcs as they are, the number of nodes would change by one where a deviation of the
    teeth or a corner grows, and the force would jump by the difference of two quadratures. A descent with
    steps below that ends there.
    """
    span = abs(good.lag_per_depth * cut.axial_depth)
    low, high = _arcs(good, in_cut(good, law, cut, span / cut.axial_depth, true_path=true_path), span)
    # A tooth that reaches farther meets the path of a turn ago, half of that travel over the radius earlier.
    return max(float((high - low).max()), 0.0) + feed_per_radian(good, cut) * TURN / good.radius


@lru_cache(maxsize=256)
def _crowded(count: int) -> tuple[Array, Array]:
    """Return places from 0 to 1, evenly but for both ends, where they crowd, and their weights, (count,)."""
    even = (np.arange(count) + 0.5) / count
    near = np.minimum(even, 1.0 - even)
    at_end = near < CROWDED
    turn = math.pi * near / CROWDED
    place = np.where(at_end, 0.5 * (near - np.sin(turn) * CROWDED / math.pi), near - 0.5 * CROWDED)
    place /= 1.0 - CROWDED
    place = np.where(even > 0.5, 1.0 - place, place)
    weight = np.where(at_end, 0.5 - 0.5 * np.cos(turn), 1.0) / (1.0 - CROWDED) / count
    for each in (place, weight):
        each.flags.writeable = False
    return place, weight


def _powers(angle: Array, highest: int) -> ComplexArray:
    """Return e^{ik angle} of the orders k up to the highest, (highest + 1, …)."""
    powers = np.empty((highest + 1, *angle.shape), complex)
    powers[0], turn = 1.0, np.exp(1j * angle)
    for order in range(highest):
        np.multiply(powers[order], turn, out=powers[order + 1])
    return powers


def _arcs(cutter: Cutter, general: General, span: float) -> tuple[Array, Array]:
    """Return the immersions of the leading end between which each tooth cuts anything, (teeth,) rad.

    A raw edge that the tooth reaches from outside is crossed at each height where the local radius, on true
    paths with the tooth's deviation, comes to its line. Else a chip begins and ends where the pass that left
    least does, which teeth that deviate move. The rest of the edge lags.
    """
    teeth, window = general.teeth, general.window
    _, radius, lag, *_ = general.outline
    deviation = cutter.radius_deviation(general.outline.height)
    radius = radius + (deviation if teeth.true_path else 0.0 * deviation)
    begins = np.arcsin(np.clip(_least_chip(teeth, deviation), -1.0, 1.0))
    low = np.maximum(window.low, (begins + window.low + lag).min(axis=1))
    high = np.minimum(window.high, (window.high - begins + lag).max(axis=1) - span) + span
    for line, ends, towards in ((teeth.begins, low, np.min), (teeth.ends, high, np.max)):
        if line.there and line.outer:
            crossing = np.arccos(np.clip(line.line / np.maximum(radius, 1e-12), -1.0, 1.0))
            ends[:] = towards(crossing + lag, axis=1)
    return low, high


def _least_chip(teeth: Teeth, deviation: Array) -> Array:
    """Return by how much more the passes before a tooth reach, over what the feed makes of it, (teeth, n).

    Of all passes the largest: the sine of the immersion at which the chip begins on circles.
    """
    count = len(deviation)
    ahead = [np.roll(deviation, -m, axis=0) for m in range(1, len(teeth.pitch) + 1)]
    travel = teeth.feed * teeth.pitch[:, :, None]
    if not travel.all():
        return np.zeros_like(deviation)
    return np.asarray(np.max((np.array(ahead) - deviation) / travel, axis=0)[:count])
