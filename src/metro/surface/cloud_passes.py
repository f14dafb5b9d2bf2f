"""A cloud read in slices, over and over: nothing that grows with the number of points is kept.

Each function is one pass: points come as rows of any floating type, are turned to columns of float64 in the
frame of a plane, and leave sums behind. The order of the points and the size of the slices only change the
rounding of the sums.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from metro.surface.areal import CellSums, Grid, Readings
from metro.surface.indices import PERCENTILES, log_mean_floor
from metro.surface.plane import Moments, Plane, moments_of_columns
from metro.surface.points import Points, slices
from metro.units import Array

SAMPLE = 60_000  # points in the sample: the median of their residuals is known to half a per cent
SUSPECT = 2.5  # robust deviations beyond which a point is looked at again
TAIL = 1.0  # per cent of the points at either end that are kept for the percentiles


@dataclass(frozen=True)
class Survey:
    """The result of the first pass over a cloud: its moments, and the corners of its box (3,)."""

    moments: Moments
    low: Array
    high: Array


@dataclass(frozen=True)
class Residuals:
    """What the pass over the residuals of a filtered surface leaves.

    ``sample``; ``suspects`` with their place in the cloud (m,) and coordinates (3, m) in the frame;
    ``sound``: moments, in the frame, of the interior points that are no suspects.
    """

    sample: Readings
    suspects: Readings
    place: np.ndarray
    coordinates: Array
    sound: Moments


def survey(points: Points) -> Survey:
    """Take moments and extents of a cloud.

    Raises
    ------
    ValueError
        Where there are no points.
    """
    moments: Moments | None = None
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for _, xyz in slices(points):
        low, high = np.minimum(low, xyz.min(axis=1)), np.maximum(high, xyz.max(axis=1))
        here = moments_of_columns(xyz)
        moments = here if moments is None else moments.merge(here)
    if moments is None:
        raise ValueError("a plane needs three points or more, found none")
    return Survey(moments, low, high)


def box_in_plane(plane: Plane, seen: Survey) -> tuple[Array, Array]:
    """Return a rectangle (2,), (2,) in the plane that holds the cloud: the outline of its box."""
    corners = np.array(np.meshgrid(*zip(seen.low, seen.high, strict=True))).reshape(3, -1).T
    flat = plane.coordinates(corners)
    return flat.min(axis=0), flat.max(axis=0)


def in_frame(points: Points, plane: Plane) -> Iterator[tuple[int, Array]]:
    """Give the slices in the frame of a plane: along its axes and its normal, from its point."""
    turn = np.vstack([plane.axes, plane.normal])
    for start, xyz in slices(points):
        yield start, turn @ (xyz - plane.point[:, None])


def cell_sums(points: Points, plane: Plane, grid: Grid) -> CellSums:
    """Sum number and deviation of the points per cell."""
    count, total = np.zeros(grid.shape).ravel(), np.zeros(grid.shape).ravel()
    for _, (u, v, w) in in_frame(points, plane):
        cells = grid.cells(u, v)
        first, last = int(cells.min()), int(cells.max()) + 1
        cells -= first
        count[first:last] += np.bincount(cells)
        total[first:last] += np.bincount(cells, weights=w)
    return CellSums(grid, count.reshape(grid.shape), total.reshape(grid.shape))


def residuals(points: Points, plane: Plane, grid: Grid, smooth: Array, inside: np.ndarray) -> Residuals:
    """Compare the points with a filtered surface, and take the moments of those that are sound.

    Parameters
    ----------
    smooth : (cells,) filtered surface. inside : (cells,) mask of the interior.
    """
    stride = max(1, len(points) // SAMPLE)
    sampled, doubtful, places, coordinates = [], [], [], []
    sound = Moments(0, np.zeros(3), np.zeros((3, 3)))
    for start, uvw in in_frame(points, plane):
        cells = grid.cells(uvw[0], uvw[1])
        residual = np.abs(uvw[2] - smooth.take(cells))
        some = slice(-start % stride, None, stride)
        sampled.append((cells[some].copy(), uvw[2, some].copy()))  # views would keep the whole slice
        least = SUSPECT * 1.4826 * float(np.median(residual[some])) if len(residual[some]) else 0.0
        odd = residual > least
        at = np.flatnonzero(odd)
        doubtful.append(cells[at])
        places.append(start + at)
        coordinates.append(uvw[:, at])
        used = inside.take(cells)
        used &= ~odd
        if used.any():
            sound = sound.merge(moments_of_columns(uvw.compress(used, axis=1)))
    uvw = np.hstack(coordinates)
    return Residuals(
        Readings(*(np.concatenate(part) for part in zip(*sampled, strict=True))),
        Readings(np.concatenate(doubtful), uvw[2]),
        np.concatenate(places),
        uvw,
        sound,
    )


@dataclass
class _Ends:
    """The lowest and highest deviations, all that lie beyond two bounds."""

    bounds: tuple[float, float]
    low: list[Array]
    high: list[Array]

    def add(self, deviations: Array) -> None:
        self.low.append(deviations[deviations <= self.bounds[0]])
        self.high.append(deviations[deviations >= self.bounds[1]])

    def percentile_range(self, count: int) -> float:
        """Range between the two percentiles of ``count`` deviations, as NumPy interpolates them."""
        low, high = np.sort(np.concatenate(self.low)), np.sort(np.concatenate(self.high))
        rank = PERCENTILES[0] / 100 * (count - 1)
        return float(_at(high[::-1], rank) - _at(low, rank))


def _at(ordered: Array, rank: float) -> float:
    return float(np.interp(rank, np.arange(len(ordered)), ordered))


def raw_readings(
    points: Points,
    planes: tuple[Plane, Plane],
    grid: Grid,
    depth: np.ndarray,
    *,
    rejected: np.ndarray,
    sample: Readings,
    step: float,
) -> tuple[dict[str, float], float, int]:
    """Read the unfiltered indices within the crop in one pass.

    Parameters
    ----------
    planes : of the frame and grid, and the one that deviations are taken from (in space).
    depth : (cells,) 0 in the rim, 1 within the crop, 2 a millimetre further in.
    rejected : places of the points that do not count, ascending. sample : of all points.
    step : rounding step of the coordinates.

    Returns
    -------
    The indices of :func:`metro.surface.indices.raw_indices`, X_m of the inner part, number of points.
    """
    frame, plane = planes
    turn = np.vstack([frame.axes, frame.normal])
    # deviation from the second plane as a linear function of the coordinates in the frame of the first
    slope, offset = turn @ plane.normal, float((frame.point - plane.point) @ plane.normal)
    kept = depth.take(sample.cells) > 0
    places = grid.corner + (np.column_stack(np.divmod(sample.cells[kept], grid.shape[1])) + 0.5) * grid.cell
    used = places @ slope[:2] + slope[2] * sample.deviations[kept] + offset
    bounds = np.percentile(used, [TAIL, 100 - TAIL]) if len(used) else np.zeros(2)
    # a point lies up to half a cell from its centre; of equal ones rounding must leave out none
    slack = grid.cell * float(np.abs(slope[:2]).sum()) / 2 + 1e-9 * float(np.ptp(used) if len(used) else 0.0)
    ends = _Ends((float(bounds[0]) + slack, float(bounds[1]) - slack), [], [])
    count, total, logs = 0, 0.0, 0.0
    extremes: list[Array] = []
    inner: list[Array] = []
    for start, uvw in in_frame(points, frame):
        label = depth.take(grid.cells(uvw[0], uvw[1]))
        first, last = np.searchsorted(rejected, [start, start + len(label)])
        label[rejected[first:last] - start] = 0
        deviation = slope @ uvw
        deviation += offset
        within = deviation[label > 0]
        if not len(within):
            continue
        size = np.abs(within)
        count += len(within)
        total += float(size.sum())
        if step:
            size[size < step / 2] = log_mean_floor(step)
        logs += float(np.log(size, out=size).sum())
        ends.add(within)
        extremes.append(np.array([within.min(), within.max()]))
        if len(deepest := deviation[label > 1]):
            inner.append(np.array([deepest.min(), deepest.max()]))
    indices = {
        "xm": float(np.ptp(extremes)),
        "xa": total / count,
        "xg": float(np.exp(logs / count)),
        "percentile_range": ends.percentile_range(count),
    }
    return indices, float(np.ptp(inner)) if inner else float("nan"), count
