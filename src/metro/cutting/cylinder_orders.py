"""Orders of the force on a cylindrical cutter, height by height, over the arc in which each tooth cuts.

At one height a tooth is a point that goes round: where its chip begins, where another pass bounds it and
where it ends do not depend on the angle of the tool, and between them all is smooth. So an order is a sum
over the teeth of an integral over the height of one over the immersion, both by Gauss's rule, which moves
with the arc. A table over even angles of the tool samples the force where it happens to be. Its orders bend
where a tooth comes to begin its cut at a sample: by so little that no prediction shows it, but a descent that
follows the slope ends there (docs/numerics.md).
"""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from metro.compiled import compiled_with_arrays
from metro.cutting.arcs import EVERYWHERE, TURN, Arc, empty_arc, find_arc
from metro.cutting.chip import Cut, feed_per_radian
from metro.cutting.corners import BEGINS, ENDS, RawEdges, raw_edges, raw_here
from metro.cutting.cutter import Cutter, pitches
from metro.cutting.edges import Piece, bounding_pass, chip_of, corner_line
from metro.cutting.law import EdgeLaw
from metro.cutting.passes import ALIKE, Passes, passes_at, row_of
from metro.cutting.quadrature import is_linear, rule
from metro.units import Array, ComplexArray

# Gauss's rule of n points is exact for the wave of order k over a length L once 2 n exceeds k L / 2 by a few.
LEAST_POINTS, POINTS_PER_WAVE = 8, 0.25
OF_ROOTS = 1.5  # as many, where roots at the ends are resolved: in the middle the nodes are as far apart
STEP = 8  # numbers of points are multiples of it: few rules are made


class _Rules(NamedTuple):
    """Gauss's rules of ``STEP``, 2 × ``STEP``, … points: places and weights (rules, most points) over 0…1."""

    places: Array
    weights: Array


class _Nodes(NamedTuple):
    """Nodes: ``arc`` (n,) index of height and tooth; immersion, rad; its weight, rad; and the chip, m."""

    arc: Array
    immersion: Array
    weight: Array
    chip: Array


def cylinder_orders(cutter: Cutter, law: EdgeLaw, cut: Cut, highest: int, *, true_path: bool) -> ComplexArray:
    """Amplitudes (highest + 1, 3, 6) of the orders of the force per unit of each coefficient, feed frame.

    As of :func:`metro.signals.orders.amplitudes`; on a level path, with the teeth where they are.
    """
    height, share = _heights(cutter, cut, highest)
    before = passes_at(cutter, cut, true_path, height)
    raw = raw_edges(cut.engagement, cutter.radius, true_path)
    even = bool(before.rows.shape[2] == 1 and np.ptp(cutter.pitch(1)) < ALIKE)
    if even:  # all teeth are alike
        before = before._replace(rows=before.rows[:, :1])
    per_radian = POINTS_PER_WAVE * (highest + 1)
    linear = is_linear(law, before.scale.feed)
    per_radian *= 1.0 if linear else OF_ROOTS
    most = LEAST_POINTS + per_radian * TURN
    nodes = _nodes(
        before, raw, empty_arc(before.rows.shape[2]), _rules(math.ceil(most / STEP), linear), per_radian
    )
    count = before.rows.shape[0] * before.rows.shape[1]
    shear, edge = (
        each.reshape(*before.rows.shape[:2], highest + 2)
        for each in _moments(nodes, law.shear(nodes.chip), count, highest + 2)
    )
    phase = np.arange(highest + 1) * np.asarray(cutter.tooth_angles)[:, None]
    turned = np.exp(1j * phase)
    turned = turned.sum(axis=0, keepdims=True) if even else turned
    if len(before.rows) == 1:  # every height goes through the same arc
        half = 0.5 * cutter.lag_per_depth * cut.axial_depth * np.arange(highest + 1)
        late = (cut.axial_depth * np.sinc(half / math.pi) * np.exp(-1j * half))[None]
    else:
        late = share[:, None] * np.exp(-1j * cutter.lag_per_depth * height[:, None] * np.arange(highest + 1))
    scale = np.where(np.arange(highest + 1) > 0, math.sqrt(2.0), 1.0) / TURN
    basis = np.zeros((highest + 1, 3, 6), complex)
    for column, moment in ((0, shear), (3, edge)):
        whole, sine, cosine = (
            scale * np.einsum("zk,jk,zjk->k", late, turned, each) for each in _turned(moment)
        )
        basis[:, 0, column], basis[:, 1, column] = -cosine, sine
        basis[:, 0, column + 1], basis[:, 1, column + 1] = -sine, -cosine
        basis[:, 2, column + 2] = whole
    return basis


def _heights(cutter: Cutter, cut: Cut, highest: int) -> tuple[Array, Array]:
    """Return heights above the tip, m, and the weight of each in an integral over the depth, m."""
    late = _Late.of(cutter, cut)
    bends = [(0.0, False), *_bends(late, cut), (cut.axial_depth, False)]
    parts = []
    for (low, before), (high, after) in pairwise(bends):
        smooth, length = not before and not after, high - low
        waves = POINTS_PER_WAVE * highest * (abs(cutter.lag_per_depth) * length + late.swing(low, high))
        places, weights = rule(LEAST_POINTS + math.ceil(waves * (1.0 if smooth else OF_ROOTS)), smooth)
        parts.append((low + length * places, length * weights))
    heights, shares = zip(*parts, strict=True)
    return np.concatenate(heights), np.concatenate(shares)


class _Late(NamedTuple):
    """How late chips begin since teeth deviate, on circles.

    The chip that a pass leaves is s sin φ + d, d = c + Re(D e^{iκz}) by how much less the tooth reaches than
    the one before: it begins where sin φ = −d/s. Arrays (passes, N): ``travel`` s, ``wave`` D, ``level`` c,
    m; ``lag`` κ, rad/m.
    """

    travel: Array
    wave: ComplexArray
    level: Array
    lag: float

    @classmethod
    def of(cls, cutter: Cutter, cut: Cut) -> _Late:
        """Describe the passes of the other teeth before each one; without a feed no chip begins late."""
        ahead = (np.arange(cutter.teeth) + np.arange(1, cutter.teeth)[:, None]) % cutter.teeth
        travel = feed_per_radian(cutter, cut) * pitches(cutter.tooth_angles, cutter.teeth)[:-1]
        crest = cutter.runout_radius * np.exp(1j * (cutter.runout_angle - np.asarray(cutter.tooth_angles)))
        reach = np.asarray(cutter.reach or (0.0,) * cutter.teeth)
        wave = crest - crest[ahead] if cut.feed_per_tooth else np.zeros_like(travel, complex)
        return cls(travel, wave, reach - reach[ahead], cutter.lag_per_depth)

    def at(self, angle: Array) -> Array:
        """Return the sine of the immersion at which a chip begins, (N, n), where κz is ``angle`` (n,)."""
        less = self.level[..., None] + (self.wave[..., None] * np.exp(1j * angle)).real
        return np.asarray((-less / self.travel[..., None]).max(axis=0, initial=0.0))

    def swing(self, low: float, high: float) -> float:
        """Return by how much the beginning of an arc moves from one height to another, at most, rad."""
        if not self.lag or not self.wave.any():
            return 0.0
        begins = np.arcsin(np.minimum(self.at(self.lag * np.linspace(low, high, 5)), 1.0))
        return float(np.abs(np.diff(begins, axis=1)).sum(axis=1).max())


def _bends(late: _Late, cut: Cut) -> list[tuple[float, bool]]:
    """Return the heights, rising, m, at which the end of an arc does not change smoothly.

    At a sine of 1 the arc closes, as a root does (then: True); at that of a raw edge, this begins it.
    """
    raw = math.sin(cut.engagement.entry), math.sin(cut.engagement.exit)
    found: dict[float, bool] = {}
    for sine in {1.0, *(each for each in raw if each > ALIKE)}:
        needed = -sine * late.travel - late.level
        for m, j in zip(*np.nonzero((np.abs(needed) < np.abs(late.wave)) & (late.lag != 0.0)), strict=True):
            turn = math.acos(needed[m, j] / abs(late.wave[m, j]))
            for angle in (turn - np.angle(late.wave[m, j]), -turn - np.angle(late.wave[m, j])):
                if late.at(np.array([angle]))[j, 0] < sine + ALIKE:  # no other pass begins it later
                    found |= dict.fromkeys(_within(angle, late.lag, cut.axial_depth), sine == 1.0)
    return sorted(found.items())


def _within(angle: float, lag: float, depth: float) -> list[float]:
    """Return the heights between 0 and the ``depth``, m, that lag by an ``angle`` but for whole turns."""
    first = (math.copysign(1.0, lag) * angle) % TURN / abs(lag)
    return [height for height in np.arange(first, depth, TURN / abs(lag)).tolist() if height > 0.0]


@lru_cache(maxsize=8)
def _rules(count: int, linear: bool) -> _Rules:
    """Return ``count`` rules; what is beyond the points of a rule is zero."""
    made = [rule(STEP * (at + 1), linear) for at in range(count)]
    places = np.zeros((count, len(made[-1][0])))
    weights = np.zeros_like(places)
    for at, (place, weight) in enumerate(made):
        places[at, : len(place)], weights[at, : len(weight)] = place, weight
    return _Rules(places, weights)


def _turned(moment: ComplexArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Integrals of f, f sin φ and f cos φ times e^{−ikφ}, of those of f at orders 0…H+1: each (…, H+1)."""
    here, above = moment[..., :-1], moment[..., 1:]
    below = np.concatenate([moment[..., 1:2].conj(), moment[..., :-2]], axis=-1)
    return here, -0.5j * (below - above), 0.5 * (below + above)


@compiled_with_arrays
def _nodes(before: Passes, raw: RawEdges, arc: Arc, rules: _Rules, per_radian: float) -> _Nodes:
    """Return the nodes of the arcs, each cut where the pass that bounds its chip changes."""
    scale, rows, bounds = before.scale, before.rows, arc.bounds
    here = raw_here(raw, 0)
    heights, teeth = rows.shape[:2]
    room, used = heights * teeth * len(bounds) * rules.places.shape[1], 0
    which, immersion = np.empty(room, np.intp), np.empty(room)
    weight, chip = np.empty(room), np.empty(room)
    for i in range(heights):
        for j in range(teeth):
            passes = rows[i, j]
            count = find_arc(scale, passes, here, EVERYWHERE, arc)
            own = row_of(passes, len(passes) - 1)
            for part in range(count - 1):
                low, length = bounds[part], bounds[part + 1] - bounds[part]
                if not length > 0.0:
                    continue
                middle = low + 0.5 * length
                lines = (
                    corner_line(here.line[BEGINS], arc.corner[BEGINS], middle),
                    corner_line(here.line[ENDS], arc.corner[ENDS], middle),
                )
                passed = row_of(passes, bounding_pass(scale, passes, middle))
                piece = Piece(passed, own, lines)
                at = int((LEAST_POINTS + per_radian * length - 1e-9) // STEP)
                at = min(at, len(rules.places) - 1)
                for k in range(rules.places.shape[1]):
                    if rules.weights[at, k] == 0.0:
                        break
                    phi = low + rules.places[at, k] * length
                    which[used], immersion[used] = i * teeth + j, phi
                    weight[used] = rules.weights[at, k] * length
                    chip[used] = chip_of(scale, piece, math.sin(phi), math.cos(phi))
                    used += 1
    return _Nodes(which[:used], immersion[:used], weight[:used], chip[:used])


@compiled_with_arrays
def _moments(nodes: _Nodes, shear: Array, arcs: int, orders: int) -> tuple[ComplexArray, ComplexArray]:
    """Integrals of shear and of one times e^{−ikφ} over each arc, (arcs, orders)."""
    of_shear = np.zeros((arcs, orders), np.complex128)
    of_edge = np.zeros((arcs, orders), np.complex128)
    for n in range(len(shear)):
        phi, weight, arc = nodes.immersion[n], nodes.weight[n], nodes.arc[n]
        turn = complex(math.cos(phi), -math.sin(phi))
        wave = complex(weight, 0.0)
        for k in range(orders):
            of_edge[arc, k] += wave
            of_shear[arc, k] += shear[n] * wave
            wave *= turn
    return of_shear, of_edge
