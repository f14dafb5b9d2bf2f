"""A cloud sampled at points of the path: mean height in a disc, which keeps most of waves beyond 5 mm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import MM, Array

RADIUS = 1.5 * MM
LEAST_POINTS = 5


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


def sample(cloud: Array, x: Array, y: Array, radius: float = RADIUS) -> Footprint:
    """Sample ``cloud`` (m, 3) in discs of ``radius`` about points ``x``, ``y`` (n,), all in one unit.

    A disc's tilt is taken out of its standard deviation, which is that of noise about the local plane in x
    and y.
    """
    disc, point = pairs_within(cloud, x, y, radius)
    u, v, z = cloud[point, 0] - x[disc], cloud[point, 1] - y[disc], cloud[point, 2]

    def total(values: Array | None = None) -> Array:
        return np.bincount(disc, weights=values, minlength=len(x)).astype(np.float64)

    count = total()
    enough = count >= LEAST_POINTS
    safe = np.maximum(count, 1)
    mean = total(z) / safe
    rest = z - mean[disc]
    for across in (u, v):  # in a full disc u and v are orthogonal to each other
        centred = across - (total(across) / safe)[disc]
        slope = total(centred * rest) / np.maximum(total(centred**2), np.finfo(float).tiny)
        rest = rest - slope[disc] * centred
    sd = np.sqrt(total(rest**2) / np.maximum(count - 3, 1))
    sector = ((np.arctan2(v, u) + np.pi) * (4 / np.pi)).astype(np.intp) % 8
    seen = np.bincount(np.unique(disc * 8 + sector) // 8, minlength=len(x)) / 8
    return Footprint(
        np.where(enough, mean, np.nan), count.astype(np.intp), np.where(enough, sd, np.nan), seen
    )


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
