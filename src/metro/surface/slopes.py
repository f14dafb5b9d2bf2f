"""Heights of stations from the slopes between them, by least squares over all loops that the lines close.

A level or an autocollimator reads the mean slope from one foot to the other. A reading of line l from station
a to station b, a distance s apart, is

    slope = (h_b − h_a) / s + zero_l + noise,

with equal noise of all readings. An autocollimator is set up anew for each line, so that each line has a zero
of its own; a level refers to gravity, so that all lines share its zero. Heights are known up to a plane: what
is stated are the deviations from the least-squares plane of the stations, which are a linear function of the
readings, so that their covariance is exact. (Haitjema, Metrology 6 (2026) 27; Moody, The Tool Engineer,
October 1955, uses the two centre lines for closure errors alone.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array

SAME = 0.01  # of the shortest step: stations closer than that are one, a height differs by 1 % of a reading
STRAIGHT = 0.99  # cosine between readings of one direction: 8 degrees
UNDETERMINED = 1e-6  # of a height of 1 that the readings leave open; rounding leaves 1e-12
MOST = 2000  # readings: the decomposition of more takes more than seconds


@dataclass(frozen=True)
class Readings:
    """Readings: places of the feet (n, 2) in m, slopes (n,) in rad, rising to ``second``; ``line`` (n,)."""

    first: Array
    second: Array
    slope: Array
    line: np.ndarray


@dataclass(frozen=True)
class Levelled:
    """Stations with their heights.

    Attributes
    ----------
    places : (p, 2), m. first, second : indices (n,) of the stations of each reading.
    heights : deviations (p,) from the least-squares plane, m.
    cofactor : (p, p), m²/rad²: times the variance of a slope it is the covariance of the heights.
    residuals : of the slopes (n,), rad. redundancy : (n,), the share of a reading's error that shows in its
        residual.
    dof : how many more readings there are than unknowns that they determine.
    """

    places: Array
    first: np.ndarray
    second: np.ndarray
    heights: Array
    cofactor: Array
    residuals: Array
    redundancy: Array
    dof: int

    @property
    def scatter(self) -> float:
        """Standard deviation of a slope by the residuals, rad; NaN where no loop is closed."""
        return float(np.sqrt(self.residuals @ self.residuals / self.dof)) if self.dof else float("nan")


def level(readings: Readings) -> Levelled:
    """Return the heights of the stations that readings join.

    Raises
    ------
    ValueError
        With the reason why these readings give no flatness.
    """
    count = len(readings.slope)
    if count > MOST:
        raise ValueError(f"there are {count} readings, at most {MOST} can be solved at once")
    step = np.linalg.norm(readings.second - readings.first, axis=1)
    places, first, second = _stations(readings, SAME * float(step.min()))
    plane = np.column_stack([np.ones(len(places)), places - places.mean(axis=0)])
    spread = np.linalg.svd(plane[:, 1:], compute_uv=False)
    if len(places) < 4 or spread[-1] < SAME * spread[0]:
        raise ValueError("all stations lie on one straight line, which shows straightness and no flatness")
    off_plane = np.linalg.qr(plane, mode="complete")[0][:, 3:]
    rows, lines = np.arange(count), np.unique(readings.line, return_inverse=True)[1]
    rise = np.zeros((count, len(places)))
    rise[rows, second], rise[rows, first] = 1.0 / step, -1.0 / step
    zeros = (lines[:, None] == np.arange(lines.max() + 1)) / step.mean()
    direction = (readings.second - readings.first) / step[:, None]
    tilt = direction / step.mean() if _bent(direction, lines) else np.empty((count, 0))
    left, size, right = np.linalg.svd(np.hstack([rise @ off_plane, zeros, tilt]), full_matrices=True)
    rank = int((size > 1e-9 * size[0]).sum())
    unknown = off_plane.shape[1]
    open_ = np.linalg.norm(off_plane @ right[rank:, :unknown].T, axis=1) > UNDETERMINED
    if open_.any():
        raise ValueError(_undetermined(readings.line, first, second))
    left = left[:, :rank]
    gain = off_plane @ (right[:rank, :unknown].T / size[:rank])
    parts = left.T @ readings.slope
    residuals = readings.slope - left @ parts
    redundancy = 1.0 - (left**2).sum(axis=1)
    return Levelled(places, first, second, gain @ parts, gain @ gain.T, residuals, redundancy, count - rank)


def _undetermined(line: np.ndarray, first: np.ndarray, second: np.ndarray) -> str:
    """Say which lines leave heights open: those that meet the others at fewer than two stations."""
    at = {each: set(first[line == each]) | set(second[line == each]) for each in np.unique(line)}
    met = {
        each: len(own & set().union(*(other for name, other in at.items() if name != each)))
        for each, own in at.items()
    }
    loose = [f"line {each} at {count}" for each, count in met.items() if count < 2]
    return (
        "the readings do not determine all heights: each line must meet the others at two stations or more, "
        f"which have the same coordinates there{': found ' if loose else ''}{', '.join(loose)}"
    )


def _bent(direction: Array, lines: np.ndarray) -> bool:
    """Return whether readings (n, 2) of a line go in several directions, where a tilt is no zero of it."""
    first = direction[np.unique(lines, return_index=True)[1]]
    return bool(((direction * first[lines]).sum(axis=1) < STRAIGHT).any())


def _stations(readings: Readings, reach: float) -> tuple[Array, np.ndarray, np.ndarray]:
    """Return the stations (p, 2), and which of them each reading starts and ends at."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    feet = np.vstack([readings.first, readings.second])
    pairs = cKDTree(feet).query_pairs(reach, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(feet), len(feet)))
    count, of = connected_components(links, directed=False)
    weights = np.bincount(of, minlength=count)
    places = np.column_stack([np.bincount(of, feet[:, k], count) / weights for k in range(2)])
    return places, of[: len(readings.slope)], of[len(readings.slope) :]
