"""Where around the tool each tooth cuts, at one angle of the tool: between its ends, and pass by pass.

Of the passes that may bound the chip the least counts. On circular paths each is A sin φ + B cos φ, so ends
and crossings of passes are closed forms; on true paths Newton steps from there settle them.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from metro.cutting.corners import Corner
from metro.cutting.engagement import Engagement
from metro.cutting.nearby import LARGEST_STEP, Edges, Nearby, nearby
from metro.cutting.passes import Passes
from metro.units import Array

STEPS_TO_ENDS, STEPS = 3, 2  # an error of a crossing counts in second order only


def arcs(
    before: Passes, engagement: Engagement, edges: Edges | None = None, corners: tuple[Corner, ...] = ()
) -> Array:
    """Immersions (bounds, angles, teeth) rad, rising, between which one pass bounds a tooth's chip.

    The first and the last are where the tooth starts and stops cutting: the first above the last where it
    does not cut. Along the feed it is the chip that begins and ends there: on true paths a little outside
    0…π. Where ``edges`` are given, bounds that they do not reach are left out, or are ends of circular paths.
    ``corners``: of the raw edges; an arc that ends at one that has none given is cut short there.
    """
    near = nearby(edges, before.sine.shape[1:])
    (low, high), between = _ends(before, near), _crossings(before, near)
    at_corners = [corner.begins for corner in corners]
    if engagement.entry > 0.0 and True not in at_corners:
        low = np.maximum(low, engagement.entry)
    if engagement.exit < math.pi and False not in at_corners:
        high = np.minimum(high, engagement.exit)
    for corner in corners:
        vanishing, whole = corner.limits
        between = np.sort(np.concatenate([between, whole[None]]), axis=0)
        if corner.begins:
            low = np.maximum(low, vanishing)
        else:
            high = np.minimum(high, vanishing)
    return np.concatenate([low[None], np.clip(between, low, high), high[None]])


def _ends(before: Passes, near: Nearby) -> Array:
    """Find the ends (2, angles, teeth) of the arc where every pass leaves a chip."""
    root = np.arctan2(-before.cosine, before.sine)
    phi = np.stack([root.max(axis=0), root.min(axis=0) + math.pi])
    if not before.true_path:
        return phi
    at = np.nonzero(near.covers(np.sin(phi), np.cos(phi)))
    passed, end, inward = before.before(*at[1:]), phi[at], 1.0 - 2.0 * at[0]
    for _ in range(STEPS_TO_ENDS):  # each to the innermost of where the passes leave none
        sine, cosine = np.sin(end), np.cos(end)
        value, growth = passed.chip(sine, cosine), inward * passed.slope(sine, cosine)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.where(growth > 0.0, -value / growth, -LARGEST_STEP).max(axis=0)
        end += inward * np.clip(step, -LARGEST_STEP, LARGEST_STEP)
    phi[at] = end
    return phi


def _crossings(before: Passes, near: Nearby) -> Array:
    """Immersions (most, angles, teeth), rising, where two passes leave the same chip, less than any other.

    Where there are fewer than most, ∞ follows.
    """
    first, second = np.triu_indices(len(before.sine), 1)
    a, b = before.sine[first] - before.sine[second], before.cosine[first] - before.cosine[second]
    with np.errstate(divide="ignore", invalid="ignore"):
        length = np.copysign(np.sqrt(a * a + b * b), b)
        sine, cosine = b / length, -a / length
    # Between centres that the pass is a turn behind: so far, relative to feed, circles stray from true paths.
    stray = 2.0 * math.pi * before.feed / before.radius if before.true_path else 0.0
    margin = (0.6 * 2.0 * math.pi * stray + 1e-9) * before.feed
    least = np.full(sine.shape, np.inf)
    for of_sine, of_cosine in zip(before.sine, before.cosine, strict=True):
        np.minimum(least, of_sine * sine + of_cosine * cosine, out=least)
    crossed = before.sine[first] * sine + before.cosine[first] * cosine
    at = np.stack(np.nonzero(near.covers(sine, cosine) & (crossed < least + margin) & (crossed > -margin)))
    phi = np.arctan2(sine[*at], cosine[*at])
    if before.true_path:  # a little outside 0…π as well
        beyond = np.stack(np.nonzero((sine < stray) & near.covers(-sine, -cosine)))
        opposite = np.arctan2(sine[*beyond], cosine[*beyond])
        phi = np.append(phi, opposite + np.where(opposite < 1.0, math.pi, -math.pi))
        at = np.concatenate([at, beyond], axis=1)
        phi = _settled(phi, before[first[at[0]], *at[1:]], before[second[at[0]], *at[1:]])
    return _in_order(phi, at[1:], before.sine.shape[1:])


def _settled(phi: Array, one: Passes, other: Passes) -> Array:
    """Newton's steps from circular paths to where two passes leave the same chip."""
    for _ in range(STEPS):
        sine, cosine = np.sin(phi), np.cos(phi)
        value = one.chip(sine, cosine) - other.chip(sine, cosine)
        slope = one.slope(sine, cosine) - other.slope(sine, cosine)
        with np.errstate(divide="ignore", invalid="ignore"):
            phi = phi - np.clip(value / slope, -LARGEST_STEP, LARGEST_STEP)
    return phi


def _in_order(phi: Array, at: npt.NDArray[np.intp], shape: tuple[int, ...]) -> Array:
    """Arrange values (n,) at rows (2, n) of a shape as columns (most in a row, *shape), rising, then ∞."""
    row = np.ravel_multi_index((at[0], at[1]), shape)
    order = np.lexsort((phi, row))
    row = row[order]
    rank = np.arange(len(row)) - np.searchsorted(row, row)
    columns = np.full((rank.max(initial=-1) + 1, math.prod(shape)), np.inf)
    columns[rank, row] = phi[order]
    return columns.reshape(-1, *shape)
