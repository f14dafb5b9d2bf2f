"""Areal parameters of a raster by ISO 25178-2: of heights, of slopes, and of how far heights are correlated.

Heights, spacings and lengths are in one unit; points without a height are NaN.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.surface.areal import GAUSSIAN, TRUNCATE
from metro.surface.plane import fit_plane
from metro.units import Array

ON_GRID = 0.05  # of the spacing, within which points lie on a raster
DECAYED = 0.2  # of the autocorrelation, which bounds Sal and Str
LEAST_SEEN = 0.5  # of the weights of the filter, with less the surface is not known
TURNS = 180  # directions in which the autocorrelation is followed


@dataclass(frozen=True, eq=False)
class Raster:
    """Heights ``z`` (rows, columns) with their spacings along y and x; NaN where there is no point."""

    z: Array
    spacing: tuple[float, float]


def raster_of(points: Array) -> Raster | None:
    """Return points (n, 3) as a raster along their x and y axes; None where they lie on no raster."""
    axes = [_axis(points[:, k]) for k in (0, 1)]
    if axes[0] is None or axes[1] is None:
        return None
    (column, dx), (row, dy) = axes[0], axes[1]
    shape = (int(row.max()) + 1, int(column.max()) + 1)
    if min(shape) < 8 or shape[0] * shape[1] > 4 * len(points):
        return None
    z = np.full(shape, np.nan)
    z[row, column] = points[:, 2]
    return Raster(z, (dy, dx))


def _axis(values: Array) -> tuple[np.ndarray, float] | None:
    """Return the number (n,) of each coordinate on an even scale, and its step; None where there is none."""
    order = np.sort(values)
    steps = np.diff(order)
    span = float(order[-1] - order[0])
    # steps between points of one line are rounding; those from line to line are the spacing
    between = steps[steps > 1e-6 * span] if span > 0.0 else steps[:0]
    if not len(between):
        return None
    number = (values - order[0]) / float(np.median(between))
    # the median of steps that are rounded is refined by the whole length
    step = span / max(round(float(number.max())), 1)
    number = (values - order[0]) / step
    nearest = np.round(number)
    if np.abs(number - nearest).max() > ON_GRID:
        return None
    return nearest.astype(np.intp), step


def scale_limited(raster: Raster, nesting_index: float) -> Array:
    """Return the S-F surface: the least-squares plane taken out, then the areal Gaussian filter (16610-61).

    Half a nesting index is left out along the rim, where the filter has less than its weights; it is NaN
    where less than half of the weights have points. ``nesting_index`` 0: the plane alone is taken out.
    """
    from scipy.ndimage import gaussian_filter

    seen = np.isfinite(raster.z)
    row, column = np.nonzero(seen)
    dy, dx = raster.spacing
    places = np.column_stack([column * dx, row * dy, raster.z[seen]])
    height = np.full(raster.z.shape, np.nan)
    height[seen] = _about_plane(places)
    if not nesting_index:
        return height
    width = [GAUSSIAN * nesting_index / step for step in raster.spacing]
    total = gaussian_filter(np.where(seen, height, 0.0), width, mode="constant", truncate=TRUNCATE)
    weight = gaussian_filter(seen.astype(float), width, mode="constant", truncate=TRUNCATE)
    smooth = np.where(seen & (weight > LEAST_SEEN), total / np.maximum(weight, LEAST_SEEN), np.nan)
    rim = [int(np.ceil(0.5 * nesting_index / step)) for step in raster.spacing]
    return np.asarray(smooth[rim[0] : -rim[0] or None, rim[1] : -rim[1] or None])


def _about_plane(places: Array) -> Array:
    """Return the heights of points over their least-squares plane, along z, which slopes are defined by."""
    plane = fit_plane(places)
    return np.asarray(plane.deviations(places) / plane.normal[2])


def areal_parameters(surface: Array, spacing: tuple[float, float]) -> dict[str, float]:
    """Return a, q, sk, ku, p, v, z (heights), dq, dr (slopes), al, tr (correlation) of an S-F surface.

    al, the autocorrelation length, and tr, the texture aspect ratio, are NaN where the autocorrelation does
    not fall to 0.2 within the surface, al in every and tr in at least one direction.

    Raises
    ------
    ValueError
        Where fewer than 64 heights are known, or all are alike.
    """
    known = surface[np.isfinite(surface)]
    if len(known) < 64 or not np.ptp(known):
        raise ValueError(f"{len(known)} heights are left of the surface, expected 64 or more that differ")
    known = known - known.mean()
    q = float(np.sqrt(np.mean(known**2)))
    gradient = np.gradient(surface, *spacing)
    square = (gradient[0] ** 2 + gradient[1] ** 2)[1:-1, 1:-1]
    square = square[np.isfinite(square)]
    shortest, longest = _correlation_lengths(surface, spacing)
    return {
        "a": float(np.abs(known).mean()),
        "q": q,
        "sk": float(np.mean(known**3)) / q**3,
        "ku": float(np.mean(known**4)) / q**4,
        "p": float(known.max()),
        "v": float(-known.min()),
        "z": float(np.ptp(known)),
        "dq": float(np.sqrt(square.mean())) if len(square) else float("nan"),
        "dr": float(np.mean(np.sqrt(1.0 + square) - 1.0)) if len(square) else float("nan"),
        "al": shortest,
        "tr": shortest / longest,
    }


def _correlation_lengths(surface: Array, spacing: tuple[float, float]) -> tuple[float, float]:
    """Return the shortest and the longest way in which the autocorrelation falls to 0.2; NaN: it does not."""
    from scipy.ndimage import map_coordinates
    from scipy.signal import fftconvolve

    seen = np.isfinite(surface)
    z = np.where(seen, surface - surface[seen].mean(), 0.0)
    pairs = fftconvolve(seen.astype(float), seen[::-1, ::-1].astype(float))
    product = fftconvolve(z, z[::-1, ::-1])
    middle = np.array(surface.shape) - 1
    alike = product / np.maximum(np.round(pairs), 1.0) / (product[tuple(middle)] / seen.sum())
    # half of the surface at most: further out few pairs are left
    reach = min(0.5 * n * step for n, step in zip(surface.shape, spacing, strict=True))
    ways = np.arange(0.0, reach, 0.5 * min(spacing))
    angle = np.arange(TURNS) * np.pi / TURNS
    at = [
        middle[k] + np.outer(turn, ways) / spacing[k] for k, turn in enumerate((np.sin(angle), np.cos(angle)))
    ]
    along = map_coordinates(alike, at, order=1, mode="nearest")
    below = along <= DECAYED
    first = np.where(below.any(axis=1), below.argmax(axis=1), -1)
    if (first < 0).all():
        return float("nan"), float("nan")
    ends = np.full(TURNS, np.nan)
    for turn in np.flatnonzero(first > 0):
        n = first[turn]
        before, after = along[turn, n - 1], along[turn, n]
        ends[turn] = ways[n - 1] + (before - DECAYED) / (before - after) * (ways[n] - ways[n - 1])
    return float(np.nanmin(ends)), float(np.max(ends))  # the longest is NaN where one direction never falls
