"""The least-squares plane of a cloud, from moments that can be gathered chunk by chunk.

The normal is the eigenvector of the smallest eigenvalue of the 3×3 scatter matrix (orthogonal distance
regression), so it does not depend on the frame, unlike a regression of z on x and y. Every chunk is shifted
by its own first point before its moments are taken, which keeps float64 exact to 1e-12 of the extents even
kilometres away from the origin.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import reduce

import numpy as np
import numpy.typing as npt

from metro.units import Array

CHUNK = 1 << 16  # rows whose float64 copy stays in the second-level cache
# Any figures will do for these that no drawing has: a face must not lie on the edge between two choices.
ELONGATED = 1.37  # variance along the longest extent over that across it, above which it is the first axis
AHEAD = np.array([1.0, 0.6180339887, 0.2360679775])  # the side that the longest extent points to
STEEP = 0.83  # component of the normal along x above which a plane faces x


@dataclass(frozen=True)
class Moments:
    """Count, centroid (3,) and scatter matrix (3, 3) about the centroid of a set of points."""

    count: int
    mean: Array
    scatter: Array

    def merge(self, other: Moments) -> Moments:
        """Return the moments of both sets together (Chan, Golub & LeVeque 1983)."""
        count = self.count + other.count
        if not self.count:
            return other
        step = other.mean - self.mean
        mean = self.mean + step * (other.count / count)
        between = np.outer(step, step) * (self.count * other.count / count)
        return Moments(count, mean, self.scatter + other.scatter + between)


@dataclass(frozen=True)
class Plane:
    """A plane: ``point`` (3,), unit ``normal`` (3,), and ``axes`` (2, 3) in it.

    The longest extent comes first where there is one (:func:`plane_of_moments`); axes and normal are
    right-handed.
    """

    point: Array
    normal: Array
    axes: Array

    def deviations(self, points: npt.NDArray[np.floating]) -> Array:
        """Orthogonal signed distances (n,) of ``points`` (n, 3), positive on the side of the normal."""
        distance = np.empty(len(points))
        for rows in _chunks(len(points)):
            distance[rows] = (points[rows].astype(np.float64) - self.point) @ self.normal
        return distance

    def coordinates(self, points: npt.NDArray[np.floating]) -> Array:
        """In-plane coordinates (n, 2) of ``points`` (n, 3) along ``axes`` from ``point``."""
        coordinates = np.empty((len(points), 2))
        for rows in _chunks(len(points)):
            coordinates[rows] = (points[rows].astype(np.float64) - self.point) @ self.axes.T
        return coordinates


def moments(points: npt.NDArray[np.floating]) -> Moments:
    """Return the moments of ``points`` (n, 3), n ≥ 1, in any floating type; summed in float64."""
    return reduce(Moments.merge, (_moments_of_chunk(points[rows]) for rows in _chunks(len(points))))


def plane_of_moments(gathered: Moments) -> Plane:
    """Return the orthogonal least-squares plane; the normal's largest component is positive.

    Raises
    ------
    ValueError
        Where fewer than three points, points on a line, or a value that is not finite leave no plane.
    """
    if gathered.count < 3 or not np.isfinite(gathered.scatter).all():
        raise ValueError(
            f"a plane needs three finite points or more, found {gathered.count} with such moments"
        )
    spread, vectors = np.linalg.eigh(gathered.scatter)
    if spread[1] <= 1e-14 * spread[2]:
        raise ValueError("the points lie on a line: no plane is defined by them")
    normal = vectors[:, 0]
    normal = normal * np.sign(normal[np.argmax(np.abs(normal))])
    return Plane(gathered.mean, normal, _axes(normal, vectors[:, 2], spread[2] / spread[1]))


def _axes(normal: Array, longest: Array, elongation: float) -> Array:
    """Return two axes (2, 3) across the unit ``normal`` that rounding cannot turn or reverse.

    An eigenvector's sign is arbitrary, and of a square face so is its direction: a grid laid along it would
    fall differently on the points from one processor to the next. The first axis is therefore the
    ``longest`` extent, towards ``AHEAD``, only where that extent is longer by ``ELONGATED``, and the x axis
    of the coordinates as seen in the plane (the y axis for a plane that faces x) elsewhere.
    """
    if elongation > ELONGATED:
        first = longest * np.sign(longest @ AHEAD)
    else:
        across = np.eye(3)[0 if abs(normal[0]) < STEEP else 1]
        first = across - (across @ normal) * normal
        first /= np.linalg.norm(first)
    return np.vstack([first, np.cross(normal, first)])


def fit_plane(points: npt.NDArray[np.floating] | Iterable[npt.NDArray[np.floating]]) -> Plane:
    """Return the plane of ``points`` (n, 3), or of an iterable of such chunks that is read once."""
    if isinstance(points, np.ndarray):
        if not len(points):
            raise ValueError("a plane needs three points or more, found none")
        return plane_of_moments(moments(points))
    return plane_of_moments(reduce(Moments.merge, (moments(chunk) for chunk in points if len(chunk))))


def moments_of_columns(xyz: Array) -> Moments:
    """Return the moments of points as columns (3, n), n ≥ 1; ``xyz`` is moved to its centroid in place."""
    shift = xyz[:, :1].copy()
    xyz -= shift
    mean = xyz.mean(axis=1)
    xyz -= mean[:, None]
    scatter = np.empty((3, 3))
    for i in range(3):  # products of rows: BLAS is slow on matrices that are three wide
        for j in range(i, 3):
            scatter[i, j] = scatter[j, i] = xyz[i] @ xyz[j]
    return Moments(xyz.shape[1], shift[:, 0] + mean, scatter)


def _moments_of_chunk(points: npt.NDArray[np.floating]) -> Moments:
    return moments_of_columns(np.array(points.T, dtype=np.float64, order="C"))


def _chunks(count: int) -> Iterator[slice]:
    return (slice(start, start + CHUNK) for start in range(0, count, CHUNK))
