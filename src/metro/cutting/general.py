"""Forces of a general cutter: integrals along the edges of its corner or ball and of its inclined flank.

The chip normal to the edge is that in the plane times sin κ (:mod:`metro.cutting.envelope`), its width a
length of the meridian. The radial force acts along the normal to the envelope, the axial force along the
meridian. Each edge is cut into panels; a panel in which the tooth starts or stops cutting, or in which
another earlier pass comes to bound the chip, is cut there, so that all is smooth between Gauss's points.
Such changes are looked for between the ends of a panel, its middle and its points, so that the chip at the
points of a panel without any is known already. Arrays have places first and edges last, those of one tooth
side by side: what depends on the place and the tooth alone is then computed once for all angles of the tool.

Raw edges and faces of the work are met at the local radius.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from metro.cutting.arcs import TURN
from metro.cutting.chip import Cut, feed_per_radian
from metro.cutting.cutter import Cutter
from metro.cutting.edges import Edges
from metro.cutting.envelope import Meridian, Place, meridian
from metro.cutting.general_teeth import Indices, Teeth, teeth_in
from metro.cutting.law import EdgeLaw
from metro.cutting.quadrature import is_linear, rule
from metro.cutting.roots import roots
from metro.units import Array

POINTS = 4
NEAR = 1e-5  # to where a panel is cut, as a share of the meridian
MARGIN = 0.05  # in feeds per tooth and pass: sin φ is 0.02 off its chord over a panel
# On true paths edges are sorted by whether one pass alone counts where there are more than a few, and where
# it does so from an immersion of this sine on: else, and on circles, it takes longer than to compute all.
FEW, WORTH = 2, 0.5
SUMS = 16


@dataclass(frozen=True, eq=False)
class _Line:
    """The meridian with its quadrature: the same for all engagements, pitches and deviations of teeth.

    Attributes
    ----------
    shares : of a panel, between which changes are looked for: its ends, its ``places`` and its middle, so
        that a tooth that only just touches the work is seldom overlooked.
    nodes : these places of all panels, (nodes,). inner : which of them are Gauss's, (points,).
    across, edgewise : (3, points) weights of 1, sin κ and cos κ at these, of an integral over the meridian's
        length, and over the edge's times cos(helix).
    """

    meridian: Meridian
    places: Array
    weights: Array
    shares: Array
    nodes: Place
    inner: Indices
    across: Array
    edgewise: Array


@lru_cache(maxsize=64)
def _line(bare: Cutter, depth: float, lag: float, feed: float, *, linear: bool) -> _Line:
    """Return the meridian of a cutter of which nothing but its end and its helix is given."""
    line = meridian(bare, depth, lag, feed)
    places, weights = rule(POINTS, linear)
    shares = np.sort(np.concatenate([[0.0, 0.5, 1.0], places]))
    panels, cells = len(line.length), len(shares) - 1
    at = np.append(np.repeat(np.arange(panels), cells), panels - 1)
    nodes = line.at(at, np.append(np.tile(shares[:-1], panels), 1.0))
    inner = (np.arange(panels)[:, None] * cells + np.isin(shares, places).nonzero()[0]).ravel()
    of_points = Place(*(each[inner] for each in (nodes.height, nodes.radius, nodes.sine, nodes.cosine)))
    factors = np.stack([np.ones(len(inner)), of_points.sine, of_points.cosine])
    across = factors * np.tile(weights, panels) * np.repeat(line.length, len(places))
    return _Line(line, places, weights, shares, nodes, inner, across, across * line.edge_length(of_points))


@dataclass(frozen=True, eq=False)
class _Work:
    """What all edges share: teeth, law, meridian, and lag (rad/m)."""

    teeth: Teeth
    law: EdgeLaw
    line: _Line
    lag: float

    def levels(self, tooth: Indices, top: Array, place: Place) -> Array:
        """Return the levels of teeth at places, all (n,): (levels, n)."""
        return self.teeth.levels(tooth, place, *_immersed(top, self.lag, place.height))

    def differences(self, first: Indices, second: Indices, tooth: Indices, top: Array, place: Place) -> Array:
        """Return levels ``first`` less levels ``second``, all (n,); one level more is zero."""
        sine, cosine = _immersed(top, self.lag, place.height)
        if self.teeth.only_passes and self.teeth.passes == 1:
            return self.teeth.after(first, tooth, place, sine, cosine)
        if self.teeth.only_passes:
            other = second < self.teeth.passes
            chips = self.teeth.after(np.stack([first, other * second]), tooth, place, sine, cosine)
            return np.asarray(chips[0] - other * chips[1])
        levels = np.concatenate([self.teeth.levels(tooth, place, sine, cosine), np.zeros((1, len(tooth)))])
        every = np.arange(len(tooth))
        return np.asarray(levels[first, every] - levels[second, every])


@dataclass(frozen=True, eq=False)
class _Cells:
    """Cells in which something changes: of which ``panel`` in a list (n,), which ``cell`` of it, (n,).

    ``values`` (2, levels, n) are the levels at both ends.
    """

    panel: Indices
    cell: Indices
    values: Array


def general_basis(cutter: Cutter, law: EdgeLaw, cut: Cut, along: Edges, *, true_path: bool) -> Array:
    """Force on a general cutter per unit of each coefficient, (angles, 3, 6), with edges ``along``.

    Shear in N per N/m² of chip area; edge in N per N/m of edge × cos(helix), as on a cylinder. Exact to 1e-5
    of the largest force on circular paths, to 1e-4 on true ones besides what ``LEAST_RADIUS`` says; but where
    an edge only just touches the end of the cut, the length that is cut is known to a few per cent.
    """
    if cut.axial_depth <= 0.0:
        return np.zeros((len(along.top), 3, 6))
    lag = 1.0 / along.depth
    bare = replace(cutter, tooth_angles=(0.0,), runout_radius=0.0, runout_angle=0.0, reach=())
    feed, linear = cut.feed_per_tooth if true_path else 0.0, is_linear(law, feed_per_radian(cutter, cut))
    line = _line(bare, cut.axial_depth, lag, feed, linear=linear)
    work = _Work(teeth_in(cutter, cut, true_path=true_path), law, line, lag)
    total = np.zeros((*along.top.shape, SUMS))
    _integrate(work, along, total)
    return _assembled(np.asarray(sum(total[:, tooth] for tooth in range(total.shape[1]))))


def _integrate(work: _Work, along: Edges, total: Array) -> None:
    """Add to ``total`` (angles, N, SUMS) what the edges give.

    Edges that are far inside the cut as a whole know one pass alone.
    """
    nodes = work.line.nodes
    low, high = work.teeth.reach(float(nodes.radius.max()))
    reached = np.mod(along.top - low, TURN) < high - low + along.span
    many = work.teeth.true_path and work.teeth.passes > FEW
    alone = work.teeth.alone_from(float(nodes.radius.min())) if many else 1.0
    if alone < WORTH:
        inward = math.asin(alone)
        leading = np.mod(along.top - inward, TURN)
        inside = reached & (leading >= along.span) & (leading <= math.pi - 2.0 * inward)
        angle = _first(inside, int(np.count_nonzero(inside, axis=0).min()))
        _some(replace(work, teeth=replace(work.teeth, passes=1)), along.top, angle, total)
        np.put_along_axis(reached, angle.T, values=False, axis=0)
    # The shorter lists end with edges that are done again, with all passes, or do not cut.
    angle = _first(reached, int(np.count_nonzero(reached, axis=0).max()))
    _some(work, along.top, angle, total)


def _first(which: npt.NDArray[np.bool_], count: int) -> Indices:
    """Return indices (N, count) of angles, those of ``which`` (angles, N) first."""
    return np.argsort(~which, axis=0, kind="stable")[:count].T


def _some(work: _Work, tops: Array, angle: Indices, total: Array) -> None:
    """Write to ``total`` what the edges of each tooth at the angles ``angle`` (N, k) give.

    Parameters
    ----------
    tops : (angles, N) immersions of all leading ends, rad.
    """
    if not angle.size:
        return
    teeth = angle.shape[0]
    own = np.arange(teeth)[:, None]
    nodes, inner = work.line.nodes, work.line.inner
    panels, cells = len(work.line.meridian.length), len(work.line.shares) - 1
    top = tops[angle, own]
    sine, cosine = _immersed(top, work.lag, nodes.height[:, None, None])
    levels = work.teeth.levels(own, nodes.shaped((-1, 1, 1)), sine, cosine)
    levels = levels.reshape(len(levels), len(nodes.height), -1)
    positive = levels > 0.0
    bound, chip = _least(levels[: work.teeth.chip_count])
    left, right = positive[:, :-1], positive[:, 1:]
    changes = (left != right).any(axis=0)
    if len(levels) > 1:
        changes |= bound[1:] != bound[:-1]
        changes &= (left | right).all(axis=0)
    changed = changes.reshape(panels, cells, -1).any(axis=1)
    whole = positive[:, :-1:cells].all(axis=0) & ~changed
    # What is left of a chip at a raw edge is bounded by several functions: it goes with the panels to be cut.
    plain = bound[:-1:cells] < work.teeth.passes
    waves = tuple(wave.reshape(len(wave), -1)[inner] for wave in (sine, cosine))
    edge, tooth = (angle * teeth + own).ravel(), np.repeat(np.arange(teeth), angle.shape[1])
    flat = total.reshape(-1, SUMS)
    flat[edge] = _whole(work, waves, chip[inner], whole & plain).T
    panel, row = np.nonzero(changed | (whole & ~plain))
    if len(row):
        crossing = _crossing(levels, changes, panel, row, changed.shape)
        _add(flat, edge[row], panel, _cut(work, tooth[row], top.ravel()[row], panel, crossing))


def _add(total: Array, at: Indices, group: Indices, values: Array) -> None:
    """Add ``values`` (n, …) to ``total`` at places that are distinct within each ``group``, rising."""
    first = np.flatnonzero(np.diff(group, prepend=-1))
    for low, high in zip(first, np.append(first[1:], len(group)), strict=True):
        total[at[low:high]] += values[low:high]


def _crossing(
    levels: Array, changes: npt.NDArray[np.bool_], panel: Indices, row: Indices, shape: tuple[int, ...]
) -> _Cells:
    """Return the cells with ``changes`` (cells, edges) of the panels (panel, row)."""
    number = np.zeros(shape, dtype=np.intp)
    number[panel, row] = np.arange(len(row))
    cell, edge = np.nonzero(changes)
    count = len(changes) // shape[0]
    values = np.stack([levels[:, cell, edge], levels[:, cell + 1, edge]])
    return _Cells(number[cell // count, edge], cell % count, values)


def _least(values: Array) -> tuple[npt.NDArray[np.int8], Array]:
    """Return which of the few values along the first axis is the least, and it: much faster than argmin."""
    bound, least = np.zeros(values.shape[1:], dtype=np.int8), values[0]
    for which in range(1, len(values)):
        less = values[which] < least
        bound[less] = which
        least = np.minimum(least, values[which])
    return bound, least


def _immersed(top: Array, lag: float, height: Array) -> tuple[Array, Array]:
    """Sine and cosine of the immersion at heights of edges with leading ends at ``top``, rad."""
    if top.ndim < 2:
        phi = top - lag * height
        return np.sin(phi), np.cos(phi)
    s, c, ls, lc = np.sin(top), np.cos(top), np.sin(lag * height), np.cos(lag * height)
    return s * lc - c * ls, c * lc + s * ls


def _whole(work: _Work, waves: tuple[Array, ...], chip: Array, whole: npt.NDArray[np.bool_]) -> Array:
    """Return sums (SUMS, edges) over the panels (panels, edges) that are ``whole``.

    Parameters
    ----------
    waves : sine and cosine of the immersion at Gauss's points of all panels, (points, edges).
    chip : in the plane, there.
    """
    line = work.line
    there = np.repeat(whole, len(line.places), axis=0)
    shear = work.law.shear(np.maximum(chip, 0.0) * line.nodes.sine[line.inner, None]) * there
    sums = [line.across @ (shear * wave) for wave in waves] + [line.across[1:] @ shear]
    sums += [line.edgewise @ (there * wave) for wave in waves] + [line.edgewise[1:] @ there]
    return np.concatenate(sums)


def _cut(work: _Work, tooth: Indices, top: Array, panel: Indices, cells: _Cells) -> Array:
    """Return sums (panels, SUMS) over the parts of panels that are cut in part or after several passes."""
    line = work.line.meridian
    breaks = _breaks(work, tooth, top, panel, cells)
    bounds = np.concatenate([np.zeros((1, len(panel))), breaks, np.ones((1, len(panel)))])
    part, at = np.nonzero(bounds[1:] > bounds[:-1])
    low, size = bounds[part, at], bounds[part + 1, at] - bounds[part, at]
    middle = work.levels(tooth[at], top[at], line.at(panel[at], low + 0.5 * size))
    kept = (middle > 0.0).all(axis=0)
    part, at, low, size, middle = part[kept], at[kept], low[kept], size[kept], middle[:, kept]
    share = low + work.line.places[:, None] * size
    place = line.at(panel[at], share)
    sine, cosine = _immersed(np.broadcast_to(top[at], share.shape).ravel(), work.lag, place.height.ravel())
    sine, cosine = sine.reshape(share.shape), cosine.reshape(share.shape)
    if work.teeth.only_passes:
        chip = work.teeth.after(_least(middle)[0].astype(np.intp), tooth[at], place, sine, cosine)
    else:
        chip = work.teeth.chips(tooth[at], place, sine, cosine).min(axis=0)
    width = work.line.weights[:, None] * size * line.length[panel[at]]
    length = width * line.edge_length(place)
    shear = work.law.shear(np.maximum(chip, 0.0) * place.sine) * width
    alone = np.ones_like(share)
    sums = []
    for amount in (shear, length):
        for wave in (sine, cosine):
            sums += [amount * wave * factor for factor in (alone, place.sine, place.cosine)]
        sums += [amount * factor for factor in (place.sine, place.cosine)]
    result = np.zeros((len(panel), SUMS))
    _add(result, at, part, np.stack([each.sum(axis=0) for each in sums], axis=1))
    return result


def _breaks(work: _Work, tooth: Indices, top: Array, panel: Indices, cells: _Cells) -> Array:
    """Shares (breaks, panels), rising, at which a level vanishes or two chips are equal; 1 where none is."""
    count, line = work.teeth.chip_count, work.line.meridian
    low, high = np.concatenate([cells.values, np.zeros((2, 1, cells.values.shape[2]))], axis=1)
    first, second = _functions(count, len(low) - 1)
    fa, fb = low[first] - low[second], high[first] - high[second]
    function, cell = np.nonzero(fa * fb < 0.0)
    fa, fb = fa[function, cell], fb[function, cell]
    if count == work.teeth.passes > 1:
        # Most passes cross where others leave less. By chords the chips are known to less than MARGIN.
        near = low[:, cell] + fa / (fa - fb) * (high[:, cell] - low[:, cell])
        margin = MARGIN * work.teeth.passes * work.teeth.cut.feed_per_tooth
        matters = near[first[function], np.arange(len(cell))] < near[:count].min(axis=0) + margin
        function, cell, fa, fb = function[matters], cell[matters], fa[matters], fb[matters]
    first, second = first[function], second[function]
    at, which = cells.panel[cell], cells.cell[cell]
    start, size = work.line.shares[which], work.line.shares[which + 1] - work.line.shares[which]
    teeth, tops, panels = tooth[at], top[at], panel[at]

    def value(share: Array, some: Indices | slice) -> Array:
        place = line.at(panels[some], start[some] + size[some] * share)
        return work.differences(first[some], second[some], teeth[some], tops[some], place)

    near = NEAR * line.length.sum() / (line.length[panels] * size)
    share = start + size * roots(value, fa, fb, near)
    order = np.lexsort((share, at))
    at, share = at[order], share[order]
    rank = np.arange(len(at)) - np.searchsorted(at, at)
    breaks = np.ones((rank.max(initial=-1) + 1, len(panel)))
    breaks[rank, at] = share
    return breaks


@lru_cache(maxsize=64)
def _functions(chips: int, levels: int) -> tuple[Indices, Indices]:
    """Levels whose difference vanishes where something changes: two chips, or any and zero, the last."""
    first, second = np.triu_indices(chips, 1)
    return np.append(first, np.arange(levels)), np.append(second, np.full(levels, levels))


def _assembled(sums: Array) -> Array:
    """Force per unit of each coefficient, (angles, 3, 6), of sums (angles, SUMS)."""
    basis = np.zeros((len(sums), 3, 6))
    for column in (0, 3):
        s, ss, sc, c, cs, cc, up, out = sums[:, column // 3 * 8 : column // 3 * 8 + 8].T
        basis[:, 0, column], basis[:, 1, column] = -c, s
        basis[:, 0, column + 1], basis[:, 1, column + 1], basis[:, 2, column + 1] = -ss, -cs, out
        basis[:, 0, column + 2], basis[:, 1, column + 2], basis[:, 2, column + 2] = sc, cc, up
    return basis
