"""A cloud sampled at points of the path: mean height in a disc, which keeps most of waves beyond 5 mm.

Of a coarse cloud the disc is larger; where the passes are near each other it is narrower, and longer instead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from metro.surface.points import Points, slices
from metro.units import MM, UM, Array

RADIUS = 1.5 * MM
LEAST_POINTS = 5
HELD = 7  # points that a disc should hold, so that few hold too few: up to a pitch of 1 mm it does
LONGEST = 2 * RADIUS  # half axis of a disc: where it would be longer, it holds fewer points
# Times the usual scatter within a disc, from which a disc holds more than the face. Of the fewest points that
# a disc is read from, noise alone goes beyond four once in a million.
BROKEN = 5.0
LEAST_SCATTER = 1 * UM  # that counts: a cloud that was computed has none


@dataclass(frozen=True)
class Window:
    """Half axes of a disc along and across a ``direction`` (a complex number of size one), m."""

    along: float = RADIUS
    across: float = RADIUS
    direction: complex = 1.0 + 0.0j

    def round(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Return coordinates, (n,) each, in which the disc is round, of the radius :data:`RADIUS`."""
        turned = (x + 1j * y) * np.conj(self.direction)
        return turned.real * (RADIUS / self.along), turned.imag * (RADIUS / self.across)


def window(pitch: float, room: float, direction: complex) -> Window:
    """Return the disc that holds enough points of a cloud of this ``pitch``, m, NaN: not known.

    ``room`` : half width that there is for it across the ``direction``, m.
    """
    radius = max(RADIUS, pitch * math.sqrt(HELD / math.pi))
    across = min(radius, room)
    return Window(min(radius**2 / across, LONGEST), across, direction)


@dataclass(frozen=True)
class Footprint:
    """Per path point (n,): mean height (NaN under five points), number and standard deviation of its points.

    ``coverage`` is the share of the disc's eight sectors that hold a point: over an edge, a disc is half
    empty.
    """

    height: Array
    count: np.ndarray
    sd: Array
    coverage: Array


def sample(
    cloud: Points, x: Array, y: Array, disc: Window | None = None, without: np.ndarray | None = None
) -> Footprint:
    """Sample ``cloud`` (m, 3) in a ``disc`` about each of the points ``x``, ``y`` (n,), m.

    A disc's tilt is taken out of its standard deviation, which is that of noise about the local plane in x
    and y.

    Parameters
    ----------
    without : places of points that do not count, ascending.
    """
    disc = disc or Window()
    discs = _Discs.empty(len(x))
    x, y = disc.round(x, y)
    for start, xyz in slices(cloud):
        points = xyz.T
        if without is not None:
            first, last = np.searchsorted(without, [start, start + len(points)])
            points = np.delete(points, without[first:last] - start, axis=0)
        points = np.column_stack([*disc.round(points[:, 0], points[:, 1]), points[:, 2]])
        discs = discs.merge(_of_slice(points, x, y, RADIUS))
    enough, safe = discs.count >= LEAST_POINTS, np.maximum(discs.count - 3, 1)
    sd = np.sqrt(np.maximum(discs.about_plane(), 0.0) / safe)
    return Footprint(
        np.where(enough, discs.mean[:, 2], np.nan),
        discs.count.astype(np.intp),
        np.where(enough, sd, np.nan),
        discs.sector.mean(axis=1),
    )


def of_the_face(sampled: Footprint) -> Array:
    """Heights (n,), m, NaN where a disc holds more than the face: a wall beside it, a burr, a chip."""
    known = sampled.sd[np.isfinite(sampled.sd)]
    usual = max(float(np.median(known)), LEAST_SCATTER) if known.size else np.inf
    return np.where(sampled.sd > BROKEN * usual, np.nan, sampled.height)


@dataclass(frozen=True)
class _Discs:
    """Count (n,), mean (n, 3) and scatter (n, 3, 3) of u, v, z in discs, and their sectors seen (n, 8)."""

    count: Array
    mean: Array
    scatter: Array
    sector: np.ndarray

    @classmethod
    def empty(cls, n: int) -> _Discs:
        return cls(np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3, 3)), np.zeros((n, 8), dtype=bool))

    def merge(self, other: _Discs) -> _Discs:
        """Return both together, as :meth:`metro.surface.plane.Moments.merge`."""
        count = self.count + other.count
        share = other.count / np.maximum(count, 1.0)
        step = other.mean - self.mean
        between = step[:, :, None] * step[:, None, :] * (self.count * share)[:, None, None]
        return _Discs(
            count,
            self.mean + step * share[:, None],
            self.scatter + other.scatter + between,
            self.sector | other.sector,
        )

    def about_plane(self) -> Array:
        """Sum (n,) of squares of z about the plane in u and v, which a full disc has orthogonal."""
        uu, vv, zz, uv, uz, vz = (
            self.scatter[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
        )
        tiny = np.finfo(float).tiny
        along_u = uz / np.maximum(uu, tiny)
        along_v = (vz - along_u * uv) / np.maximum(vv, tiny)
        return np.asarray(zz - along_u * uz - along_v * (vz - along_u * uv))


def _of_slice(points: Array, x: Array, y: Array, radius: float) -> _Discs:
    disc, point = pairs_within(points, x, y, radius)
    n = len(x)
    coordinates = np.stack([points[point, 0] - x[disc], points[point, 1] - y[disc], points[point, 2]])

    def total(values: Array) -> Array:
        return np.bincount(disc, weights=values, minlength=n).astype(np.float64)

    count = np.bincount(disc, minlength=n).astype(np.float64)
    mean = np.stack([total(each) for each in coordinates], axis=1) / np.maximum(count, 1.0)[:, None]
    centred = coordinates - mean[disc].T
    scatter = np.stack([[total(a * b) for b in centred] for a in centred]).transpose(2, 0, 1)
    angle = np.arctan2(coordinates[1], coordinates[0])
    sector = np.zeros((n, 8), dtype=bool)
    sector[disc, ((angle + np.pi) * (4 / np.pi)).astype(np.intp) % 8] = True
    return _Discs(count, mean, scatter, sector)


def pairs_within(cloud: Array, x: Array, y: Array, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Return all (disc, point) pairs: points sorted by square cells, three runs of cells per disc."""
    corner = np.array([x.min(), y.min()]) - 2 * radius
    near = (cloud[:, 0] >= corner[0]) & (cloud[:, 0] <= x.max() + 2 * radius)
    near &= (cloud[:, 1] >= corner[1]) & (cloud[:, 1] <= y.max() + 2 * radius)
    kept = np.flatnonzero(near)
    column = ((cloud[kept, 0] - corner[0]) / radius).astype(np.int32)
    row = ((cloud[kept, 1] - corner[1]) / radius).astype(np.int32)
    columns = int((x.max() - corner[0]) / radius) + 4
    cell = row * np.int32(columns) + column
    order = np.argsort(cell, kind="stable")
    ordered = cell[order]
    home = ((y - corner[1]) / radius).astype(np.int32) * np.int32(columns) + (
        (x - corner[0]) / radius
    ).astype(np.int32)
    runs = home[:, None] + np.array([-1, 0, 1], dtype=np.int32) * np.int32(columns)  # (n, 3) middle cells
    first = np.searchsorted(ordered, runs - 1, side="left").ravel()
    length = np.searchsorted(ordered, runs + 1, side="right").ravel() - first
    disc = np.repeat(np.repeat(np.arange(len(x)), 3), length)
    offset = np.arange(len(disc)) - np.repeat(np.cumsum(length) - length, length)
    point = kept[order[np.repeat(first, length) + offset]]
    inside = (cloud[point, 0] - x[disc]) ** 2 + (cloud[point, 1] - y[disc]) ** 2 <= radius**2
    return disc[inside], point[inside]
