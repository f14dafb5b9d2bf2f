"""Which tooth cuts where, and what it meets there: pitch, helix and runout as windows of engagement.

In a window, a tooth at this angle on the tool cuts while its immersion lies between two angles, and meets
the surface made there a certain turn of the tool before. Equal teeth have one window each, all one pitch
back; unequal pitch makes the turns differ; with runout a tooth may clear what several earlier ones left.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from metro.dynamics.system import Cut
from metro.units import Array


@dataclass(frozen=True)
class Window:
    """Engagement of one tooth with one earlier surface; all in rad.

    Attributes
    ----------
    angle : clockwise place of the tooth on the tool.
    delay : turn of the tool since the surface was left.
    entry, exit : immersion between which it is met.
    """

    angle: float
    delay: float
    entry: float
    exit: float


@dataclass(frozen=True)
class Engagement:
    """All windows of a tool in a cut.

    Attributes
    ----------
    cut : directions and coefficients of the force.
    windows : of all teeth; they repeat after a ``turn`` of the tool, rad.
    lag : of the helix, tan(helix angle) / radius: rad per m of z.
    """

    cut: Cut
    windows: tuple[Window, ...]
    turn: float
    lag: float = 0.0


def equal_teeth(cut: Cut, lag: float = 0.0) -> Engagement:
    """Return the engagement of equally spaced, equally long teeth; ``lag`` = tan(helix) / radius, 1/m."""
    windows = [Window(j * cut.pitch, cut.pitch, cut.entry, cut.exit) for j in range(cut.teeth)]
    return Engagement(cut, tuple(windows), cut.pitch, lag)


def unequal_teeth(cut: Cut, pitch: Array, lag: float = 0.0) -> Engagement:
    """Return the engagement of teeth at unequal ``pitch``.

    Parameters
    ----------
    pitch : (teeth,) angle from each tooth clockwise to the next, rad; they add up to a turn.

    Raises
    ------
    ValueError
        When there is not one pitch per tooth, or they do not add up to a turn.
    """
    angle = _places(cut, pitch)
    windows = [Window(float(a), float(p), cut.entry, cut.exit) for a, p in zip(angle, pitch, strict=True)]
    return Engagement(cut, tuple(windows), 2.0 * math.pi, lag)


def eccentric_teeth(
    cut: Cut, pitch: Array, reach: Array, feed_per_tooth: float, lag: float = 0.0
) -> Engagement:
    """Return the engagement of teeth of unequal ``reach``: runout, at the tool's end.

    Tooth j meets the surface that the m-th tooth before it left where that makes its chip, ``m s sin(phi) +
    R_j - R_(j+m)``, the thinnest, and cuts nothing where that is negative.

    Parameters
    ----------
    cut : in the feed frame.
    pitch : (teeth,) angle from each tooth clockwise to the next, rad.
    reach : (teeth,) deviation of each tooth's radius, m.
    feed_per_tooth : mean over the teeth, m.

    Raises
    ------
    ValueError
        When there is not one reach per tooth, or :func:`unequal_teeth` refuses the pitch.
    """
    if len(reach) != cut.teeth:
        raise ValueError(f"{len(reach)} reaches: expected {cut.teeth}, one per tooth")
    angle = _places(cut, pitch)
    feed = feed_per_tooth * cut.teeth / (2.0 * math.pi)  # m per rad
    windows: list[Window] = []
    for j in range(cut.teeth):
        delay = np.cumsum(np.roll(pitch, -j))
        shorter = reach[j] - np.roll(reach, -j - 1)  # than the m-th tooth before, m = 1 … N
        for m, (low, high) in _thinnest(feed * delay, shorter).items():
            for entry, leave in _immersions(low, high, cut):
                windows.append(Window(float(angle[j]), float(delay[m]), entry, leave))
    return Engagement(cut, tuple(windows), 2.0 * math.pi, lag)


def _places(cut: Cut, pitch: Array) -> Array:
    """Angle of each tooth from the first, clockwise."""
    if len(pitch) != cut.teeth:
        raise ValueError(f"{len(pitch)} pitch angles: expected {cut.teeth}, one per tooth")
    if abs(sum(pitch) - 2.0 * math.pi) > 1e-6:
        raise ValueError(f"pitch angles add up to {math.degrees(sum(pitch)):.3f} deg: expected 360")
    return np.concatenate([[0.0], np.cumsum(pitch)[:-1]])


def _thinnest(slope: Array, offset: Array) -> dict[int, tuple[float, float]]:
    """Range of x in (0, 1) where line m, ``slope_m x + offset_m``, is the lowest of all and positive."""
    ranges = {}
    for m in range(len(slope)):
        # slope_gap x + gap <= 0 against every line, and against zero turned round
        slope_gap = np.append(slope[m] - np.delete(slope, m), -slope[m])
        gap = np.append(offset[m] - np.delete(offset, m), -offset[m])
        ends = -gap[slope_gap != 0.0] / slope_gap[slope_gap != 0.0]
        falls = slope_gap[slope_gap != 0.0] < 0.0
        low, high = max(0.0, ends[falls].max(initial=0.0)), min(1.0, ends[~falls].min(initial=1.0))
        if high > low and not np.any(gap[slope_gap == 0.0] > 0.0):
            ranges[m] = (float(low), float(high))
    return ranges


def _immersions(low: float, high: float, cut: Cut) -> list[tuple[float, float]]:
    """Parts of the cut in which sin(phi) lies between ``low`` and ``high``."""
    a, b = math.asin(low), math.asin(high)
    bounds = [(a, b), (math.pi - b, math.pi - a)] if high < 1.0 else [(a, math.pi - a)]
    inside = [(max(s, cut.entry), min(e, cut.exit)) for s, e in bounds]
    return [(s, e) for s, e in inside if e > s]


def mean_directional_factors(engagement: Engagement, depth: Array, steps: int) -> tuple[Array, Array]:
    """Force per depth and displacement (k, steps, d, 2, 2), N/m², and the d delays it acts after, rad.

    Exact means over each of ``steps`` equal steps of the period and over the height of ``depth`` (k,).
    """
    cut = engagement.cut
    products, delays = _mean_products(engagement, depth, steps)
    ss, sc, cc = np.moveaxis(products, -1, 0)
    rows = [-(cut.ktc * sc + cut.krc * ss), -(cut.ktc * cc + cut.krc * sc)]
    rows += [cut.ktc * ss - cut.krc * sc, cut.ktc * sc - cut.krc * cc]
    return np.stack(rows, axis=-1).reshape(*ss.shape, 2, 2), delays


def mean_damping_factors(engagement: Engagement, depth: Array, steps: int) -> Array:
    """Force per depth and displacement per radian of spindle's turn (k, steps, 2, 2), N/m².

    Of process damping; means as those of :func:`mean_directional_factors`.
    """
    products, _ = _mean_products(engagement, depth, steps)
    ss, sc, cc = np.moveaxis(products.sum(axis=2), -1, 0)
    return -engagement.cut.damping * np.stack([ss, sc, sc, cc], axis=-1).reshape(*ss.shape, 2, 2)


def _mean_products(engagement: Engagement, depth: Array, steps: int) -> tuple[Array, Array]:
    """Mean sums over the teeth in cut of sin², sin cos, cos² (k, steps, d, 3), by delay (d,), rad."""
    edges = engagement.turn * np.arange(steps + 1) / steps
    delays = sorted({window.delay for window in engagement.windows})
    total = np.zeros((len(depth), steps, len(delays), 3))
    lag = engagement.lag * np.asarray(depth)[:, None]
    for window, turns in itertools.product(engagement.windows, range(-2, 2)):
        phi = edges + window.angle + 2.0 * math.pi * turns
        if phi[-1] > window.entry and phi[0] - lag.max() < window.exit:
            means = np.diff(_height_mean(phi, lag, window), axis=1) * steps / engagement.turn
            total[:, :, delays.index(window.delay)] += means
    return total, np.array(delays)


def _height_mean(phi: Array, lag: Array, window: Window) -> Array:
    """Antiderivative (k, steps + 1, 3) of sin², sin cos, cos² inside the window, averaged over the height."""
    if not np.any(lag):
        return np.broadcast_to(_once(phi, window), (len(lag), len(phi), 3))
    return (_twice(phi, window) - _twice(phi - lag, window)) / lag[..., None]


def _once(phi: Array, window: Window) -> Array:
    phi = np.clip(phi, window.entry, window.exit)
    return np.stack([phi / 2 - np.sin(2 * phi) / 4, np.sin(phi) ** 2 / 2, phi / 2 + np.sin(2 * phi) / 4], -1)


def _twice(phi: Array, window: Window) -> Array:
    """Antiderivative of ``_once``: zero before the window, straight after it."""
    at = np.clip(phi, window.entry, window.exit)
    square, start = at**2 / 4, _once(np.array(window.entry), window)
    inside = np.stack(
        [square + np.cos(2 * at) / 8, at / 4 - np.sin(2 * at) / 8, square - np.cos(2 * at) / 8], -1
    )
    beyond = np.maximum(phi - window.exit, 0.0)[..., None] * _once(np.array(window.exit), window)
    # _once is not zero before the window but constant there
    before = np.minimum(phi - window.entry, 0.0)[..., None] * start
    return np.asarray(inside + beyond + before)
