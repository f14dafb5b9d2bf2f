"""Forces of a general cutter: integrals along the edges of its corner or ball and of its inclined flank.

The chip normal to the edge is that in the plane times sin κ (:mod:`metro.cutting.envelope`), its width a
length of the meridian. The radial force acts along the normal to the envelope, the axial force along the
meridian. Each edge is cut into panels; a panel in which the tooth starts or stops cutting, or in which
another earlier pass comes to bound the chip, is cut there, so that all is smooth between Gauss's points.

Raw edges and faces of the work are met at the local radius.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.cutting.chip import Cut, feed_per_radian
from metro.cutting.cutter import Cutter
from metro.cutting.edges import is_linear, rule
from metro.cutting.envelope import Meridian, meridian
from metro.cutting.general_teeth import Indices, Teeth, teeth_in
from metro.cutting.law import EdgeLaw
from metro.cutting.nearby import Edges
from metro.units import Array

POINTS = 4
STEPS, EXACT = 8, 1e-6  # of the secant method, to where a panel is cut; in feeds per tooth
MARGIN = 0.05  # in feeds per tooth and pass: sin φ is 0.02 off its chord over a panel
OUTSIDE = 0.1  # sine of the immersion behind which no tooth cuts on true paths
SUMS = 16


@dataclass(frozen=True, eq=False)
class _Work:
    """What all edges share: teeth, law, meridian, lag (rad/m), and the quadrature of a panel."""

    teeth: Teeth
    law: EdgeLaw
    line: Meridian
    lag: float
    places: Array
    weights: Array

    def levels(self, tooth: Indices, top: Array, panel: Indices, share: Array) -> Array:
        """Return the levels of teeth at shares of panels, all (n,): (levels, n)."""
        place = self.line.at(panel, share)
        return self.teeth.levels(tooth, place, *_immersed(top, self.lag, place.height))


def general_basis(cutter: Cutter, law: EdgeLaw, cut: Cut, along: Edges, *, true_path: bool) -> Array:
    """Force on a general cutter per unit of each coefficient, (angles, 3, 6), with edges ``along``.

    Shear in N per N/m² of chip area; edge in N per N/m of edge × cos(helix), as on a cylinder. Exact to 1e-5
    of the largest force on circular paths, to 1e-4 on true ones besides what ``LEAST_RADIUS`` says.
    """
    shape = along.top.shape
    if cut.axial_depth <= 0.0:
        return np.zeros((shape[0], 3, 6))
    lag = 1.0 / along.depth
    work = _Work(
        teeth_in(cutter, cut, true_path=true_path),
        law,
        meridian(cutter, cut.axial_depth, lag),
        lag,
        *rule(POINTS, is_linear(law, feed_per_radian(cutter, cut))),
    )
    total = np.zeros((along.top.size, SUMS))
    _integrate(work, along.top.ravel(), shape[1], total)
    return _assembled(total.reshape(*shape, SUMS).sum(axis=1))


def _integrate(work: _Work, top: Array, teeth: int, total: Array) -> None:
    """Add to ``total`` (edges, SUMS) what edges with leading ends at immersions ``top`` (edges,) give."""
    last = len(work.line.length) - 1
    ends = work.line.at(np.append(np.arange(last + 1), last), np.append(np.zeros(last + 1), 1.0))
    sine, cosine = _immersed(top[:, None], work.lag, ends.height)
    (edge,) = np.nonzero((sine > (-OUTSIDE if work.teeth.true_path else 0.0)).any(axis=1))
    tooth = edge % teeth
    levels = work.teeth.levels(tooth[:, None], ends, sine[edge], cosine[edge])
    bound = levels[: work.teeth.chip_count].argmin(axis=0)
    positive = levels > 0.0
    cutting = np.asarray(positive.all(axis=0))
    changes = (positive[..., 1:] != positive[..., :-1]).any(axis=0) | (bound[:, 1:] != bound[:, :-1])
    changes &= (positive[..., 1:] | positive[..., :-1]).all(axis=0)
    whole = cutting[:, 1:] & ~changes
    (some,) = np.nonzero(whole.any(axis=1))
    total[edge[some]] = _whole(work, tooth[some], top[edge[some]], whole[some])
    row, panel = np.nonzero(changes)
    if len(row):
        values = np.stack([levels[:, row, panel], levels[:, row, panel + 1]])
        np.add.at(total, edge[row], _cut(work, tooth[row], top[edge[row]], panel, values))


def _immersed(top: Array, lag: float, height: Array) -> tuple[Array, Array]:
    """Sine and cosine of the immersion at heights of edges with leading ends at ``top``, rad."""
    if top.ndim < 2:
        phi = top - lag * height
        return np.sin(phi), np.cos(phi)
    s, c, ls, lc = np.sin(top), np.cos(top), np.sin(lag * height), np.cos(lag * height)
    return s * lc - c * ls, c * lc + s * ls


def _whole(work: _Work, tooth: Indices, top: Array, whole: Array) -> Array:
    """Return sums (edges, SUMS) over the panels (edges, panels) that are ``whole``."""
    count, line = len(work.places), work.line
    panel = np.repeat(np.arange(whole.shape[1]), count)
    place = line.at(panel, np.tile(work.places, whole.shape[1]))
    sine, cosine = _immersed(top[:, None], work.lag, place.height)
    chips = work.teeth.chips(tooth[:, None], place, sine, cosine)
    chip = np.maximum(chips[0] if len(chips) == 1 else chips.min(axis=0), 0.0)
    width = np.tile(work.weights, whole.shape[1]) * line.length[panel]
    length = width * line.edge_length(place)
    there = np.repeat(whole, count, axis=1)
    shear = work.law.shear(chip * place.sine) * there
    across = np.stack([width, width * place.sine, width * place.cosine], axis=1)
    edgewise = np.stack([length, length * place.sine, length * place.cosine], axis=1)
    sums = [(shear * wave) @ across for wave in (sine, cosine)] + [shear @ across[:, 1:]]
    sums += [(there * wave) @ edgewise for wave in (sine, cosine)] + [there @ edgewise[:, 1:]]
    return np.concatenate(sums, axis=1)


def _cut(work: _Work, tooth: Indices, top: Array, panel: Indices, values: Array) -> Array:
    """Return sums (panels, SUMS) over the parts of panels that are cut in part or after several passes.

    ``values`` (2, levels, panels) are the levels at both ends.
    """
    breaks = _breaks(work, tooth, top, panel, values)
    bounds = np.concatenate([np.zeros((1, len(panel))), breaks, np.ones((1, len(panel)))])
    part, at = np.nonzero(np.diff(bounds, axis=0) > 0.0)
    low, size = bounds[part, at], bounds[part + 1, at] - bounds[part, at]
    middle = work.levels(tooth[at], top[at], panel[at], low + 0.5 * size)
    kept = (middle > 0.0).all(axis=0)
    at, low, size = at[kept], low[kept], size[kept]
    share = low + work.places[:, None] * size
    place = work.line.at(panel[at], share)
    sine, cosine = _immersed(np.broadcast_to(top[at], share.shape).ravel(), work.lag, place.height.ravel())
    sine, cosine = sine.reshape(share.shape), cosine.reshape(share.shape)
    chip = np.maximum(work.teeth.chips(tooth[at], place, sine, cosine).min(axis=0), 0.0)
    width = work.weights[:, None] * size * work.line.length[panel[at]]
    length = width * work.line.edge_length(place)
    shear = work.law.shear(chip * place.sine) * width
    alone = np.ones_like(share)
    sums = []
    for amount in (shear, length):
        for wave in (sine, cosine):
            sums += [amount * wave * factor for factor in (alone, place.sine, place.cosine)]
        sums += [amount * factor for factor in (place.sine, place.cosine)]
    result = np.zeros((len(panel), SUMS))
    np.add.at(result, at, np.stack([each.sum(axis=0) for each in sums], axis=1))
    return result


def _breaks(work: _Work, tooth: Indices, top: Array, panel: Indices, values: Array) -> Array:
    """Shares (breaks, panels), rising, at which a level vanishes or two chips are equal.

    0 where there is none. By the Illinois form of false position from the ``values`` (2, levels, panels) at
    the ends, of all functions that change their sign in a panel at once.
    """
    count = work.teeth.chip_count
    low, high = np.concatenate([values, np.zeros((2, 1, values.shape[2]))], axis=1)
    first, second = (
        np.append(each, one)
        for each, one in zip(
            np.triu_indices(count, 1),
            (np.arange(len(low) - 1), np.full(len(low) - 1, len(low) - 1)),
            strict=True,
        )
    )
    fa, fb = low[first] - low[second], high[first] - high[second]
    function, at = np.nonzero(fa * fb < 0.0)
    if count == work.teeth.passes > 1:
        # Most passes cross where others leave less. By chords the chips are known to less than MARGIN.
        chord = fa[function, at] / (fa[function, at] - fb[function, at])
        near = low[:, at] + chord * (high[:, at] - low[:, at])
        margin = MARGIN * work.teeth.passes * work.teeth.cut.feed_per_tooth
        matters = near[first[function], np.arange(len(at))] < near[:count].min(axis=0) + margin
        function, at = function[matters], at[matters]
    fa, fb, a, b = fa[function, at], fb[function, at], np.zeros(len(at)), np.ones(len(at))
    first, second, every = first[function], second[function], np.arange(len(at))
    share = b
    for _ in range(STEPS):
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(fb == fa, b, b - fb * (b - a) / (fb - fa))
        levels = work.levels(tooth[at], top[at], panel[at], work.line.share(panel[at], share))
        levels = np.concatenate([levels, np.zeros((1, len(at)))])
        value = levels[first, every] - levels[second, every]
        if np.abs(value).max(initial=0.0) < EXACT * work.teeth.cut.feed_per_tooth:
            break
        crossed = value * fb < 0.0
        a, fa = np.where(crossed, b, a), np.where(crossed, fb, 0.5 * fa)
        b, fb = share, value
    share = work.line.share(panel[at], np.clip(share, 0.0, 1.0))
    order = np.lexsort((share, at))
    at, share = at[order], share[order]
    rank = np.arange(len(at)) - np.searchsorted(at, at)
    breaks = np.ones((rank.max(initial=-1) + 1, len(panel)))
    breaks[rank, at] = share
    return breaks


def _assembled(sums: Array) -> Array:
    """Force per unit of each coefficient, (angles, 3, 6), of sums (angles, SUMS)."""
    basis = np.zeros((len(sums), 3, 6))
    for column in (0, 3):
        s, ss, sc, c, cs, cc, up, out = sums[:, column // 3 * 8 : column // 3 * 8 + 8].T
        basis[:, 0, column], basis[:, 1, column] = -c, s
        basis[:, 0, column + 1], basis[:, 1, column + 1], basis[:, 2, column + 1] = -ss, -cs, out
        basis[:, 0, column + 2], basis[:, 1, column + 2], basis[:, 2, column + 2] = sc, cc, up
    return basis
