"""Two logs of one programmed path, brought together by position along it: in time they started apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import MM, Array

LEAST_BIN = 0.5 * MM
LEAST_SHARE = 0.5
STANDSTILL = 0.1
ASIDE = 2  # bins to either side, between which a slope is taken


@dataclass(frozen=True, eq=False)
class Aligned:
    """Means of two logs over the same bins along a path.

    Attributes
    ----------
    s : (m,) middle of each bin, m from the start of the reference path.
    first, second : (m, k) mean of each log's channels in the bin; every bin holds samples of both.
    """

    s: Array
    first: Array
    second: Array


def moving(path: Array) -> np.ndarray:
    """Find the samples (n,) of a commanded path (n, 3) that move: faster than a tenth of its usual speed.

    At a standstill friction is anybody's guess, and many samples share one place.
    """
    step = np.linalg.norm(np.diff(path, axis=0), axis=1)
    step = np.append(step, step[-1])
    usual = np.median(step[step > 0]) if (step > 0).any() else 0.0
    return np.asarray(step > STANDSTILL * usual)


def along_path(points: Array, reference: Array) -> Array:
    """Arc length (n,) of the places nearest to points, as :func:`projected`."""
    return projected(points, reference)[0]


def projected(points: Array, reference: Array) -> tuple[Array, Array]:
    """Arc length along a polyline ``reference`` (r, 3) nearest to ``points`` (n, 3), and how far away it is.

    Both (n,), m; the first NaN beyond the polyline's ends. Its successive points must differ, and it must not
    come back to where it was.
    """
    from scipy.spatial import cKDTree

    chord = np.diff(reference, axis=0)
    length = np.linalg.norm(chord, axis=1)
    arc = np.concatenate([[0.0], np.cumsum(length)])
    _, nearest = cKDTree(reference).query(points)
    last = len(chord) - 1
    candidates = np.stack([np.clip(nearest - 1, 0, last), np.clip(nearest, 0, last)])
    share = (
        np.einsum("cnk,cnk->cn", points - reference[candidates], chord[candidates]) / length[candidates] ** 2
    )
    inside = np.clip(share, 0.0, 1.0)
    foot = reference[candidates] + inside[:, :, None] * chord[candidates]
    away = np.linalg.norm(points - foot, axis=2)
    best = np.argmin(away, axis=0)
    pick = (best, np.arange(len(points)))
    beyond = ((candidates[pick] == 0) & (share[pick] < -1e-9)) | (
        (candidates[pick] == last) & (share[pick] > 1 + 1e-9)
    )
    place = arc[candidates[pick]] + inside[pick] * length[candidates[pick]]
    return np.where(beyond, np.nan, place), away[pick]


def align(
    s_first: Array,
    first: Array,
    s_second: Array,
    second: Array,
    width: float = 1 * MM,
    *,
    gaps: bool = False,
) -> Aligned:
    """Average two logs over common bins along the path, and bring the means to the middles of the bins.

    The samples of a bin lie about its middle as the log happens to have been taken, up to half a sample's
    step from it: the slope between the neighbouring means takes them there. Channels that are linear in s
    come out exact.

    Parameters
    ----------
    s_first, s_second : (n,), (n',) position of each sample along the path, m; NaN for those that do not
        count.
    first, second : (n, k), (n', k) channels. width : of a bin, m.
    gaps : whether one of the logs lost samples. A bin at the end of a gap holds a few samples at one side of
        it: bins with less than half of the usual number are left out then.

    Raises
    ------
    ValueError
        If the bins are narrower than 0.5 mm (too few samples to average out the torque's noise), or if the
        second log (the idle run) is empty or covers less than half of the first's path.
    """
    if width < LEAST_BIN:
        raise ValueError(f"bins of {width / MM:.3g} mm: at least {LEAST_BIN / MM:g} mm are needed")
    (start, end), (start_2, end_2) = _range(s_first), _range(s_second)
    shared = min(end, end_2) - max(start, start_2)
    if not shared >= LEAST_SHARE * (end - start):
        raise ValueError(
            f"the idle run covers {max(shared, 0.0) / MM:.1f} mm of the {(end - start) / MM:.1f} mm "
            "of the cut's path"
        )
    count = max(int(shared / width), 1)
    edges: Array = max(start, start_2) + width * np.arange(count + 1, dtype=float)
    mean_1, mean_2 = (
        bin_means(s, np.column_stack([channels, s]), edges)
        for s, channels in ((s_first, first), (s_second, second))
    )
    full = np.isfinite(mean_1).all(axis=1) & np.isfinite(mean_2).all(axis=1)
    if gaps:
        full &= _filled(s_first, edges) & _filled(s_second, edges)
    middle = (edges[:-1] + width / 2)[full]
    return Aligned(middle, _at(middle, mean_1[full]), _at(middle, mean_2[full]))


def _filled(s: Array, edges: Array) -> np.ndarray:
    """Find the bins (m,) with at least half as many samples as is usual where there are any."""
    count = np.histogram(s[np.isfinite(s)], edges)[0]
    return np.asarray(count >= 0.5 * np.median(count[count > 0]))


def _at(middle: Array, means: Array) -> Array:
    """Channels (m, k) at the middles of bins, from their means and, in the last column, where these lie."""
    values, place = means[:, :-1], means[:, -1]
    if len(place) < 2:
        return values
    slope = np.stack([np.gradient(channel, place) for channel in values.T], axis=1)
    return np.asarray(values + slope * (middle - place)[:, None])


def bin_means(s: Array, values: Array, edges: Array) -> Array:
    """Mean (m, k) of ``values`` (n, k) over the bins between ``edges`` (m + 1,); NaN where a bin is empty."""
    place = np.searchsorted(edges, s, side="right") - 1
    inside = np.isfinite(s) & (place >= 0) & (place < len(edges) - 1)
    count = np.bincount(place[inside], minlength=len(edges) - 1).astype(float)
    sums = np.stack([np.bincount(place[inside], v, len(edges) - 1) for v in values[inside].T], axis=1)
    return np.asarray(sums / np.where(count > 0, count, np.nan)[:, None])


def slopes(values: Array, time: Array) -> Array:
    """Slopes (m, k) of ``values`` (m, k) of bins over their ``time`` (m,), across four bins.

    Stamps of single samples are late by several periods, which makes the mean of their slopes too steep.
    """
    place = np.arange(len(time))
    first, last = np.maximum(place - ASIDE, 0), np.minimum(place + ASIDE, len(time) - 1)
    lasted = np.maximum(time[last] - time[first], np.finfo(float).tiny)
    return np.asarray((values[last] - values[first]) / lasted[:, None])


def _range(s: Array) -> tuple[float, float]:
    """Span of the positions that count; an empty one for none."""
    known = s[np.isfinite(s)]
    return (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)
