"""What a point cloud shows beside one face: planes, groups apart, outliers, and the pose of another cloud.

The search is Open3D's. Its random draws are seeded, so that a cloud gives the same answer each time; the
least squares that follow it are those of :mod:`metro.surface.plane`. Lengths are in the unit of the points.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from metro.surface.extent import face_sides
from metro.surface.plane import Plane, fit_plane
from metro.units import Array

MISSED = 1e-3  # probability that no three of the points that were drawn lie on a plane of the least share
SETTLED = 20  # rounds of points and least-squares plane, which end where the points stay the same
LEAST_GROUP = 10  # points
NEIGHBOURS = 20
NORMAL_MEDIAN = 0.6745  # of the size of a standard normal deviate
FREE = 1e-4  # smallest over largest eigenvalue of the pairs' normal equations, lengths over the cloud's size
FURTHER = 3.0  # standard deviations of the distance to the neighbours over the cloud


@dataclass(frozen=True, eq=False)
class PlaneSeen:
    """A plane in a cloud.

    Attributes
    ----------
    plane : by orthogonal least squares. members : (k,) rows of the cloud that belong to it.
    sides : (2,) of the smallest rectangle about them, the longer one first. rms : of their distances.
    """

    plane: Plane
    members: np.ndarray
    sides: Array
    rms: float


@dataclass(frozen=True, eq=False)
class Pose:
    """A rigid motion ``points @ rotation.T + shift`` of a cloud onto another.

    ``share`` of its points have a neighbour in the other cloud, at distances along its normal whose standard
    deviation is ``spread`` (by their median, since edges have normals of two faces).
    """

    rotation: Array
    shift: Array
    share: float
    spread: float

    def apply(self, points: Array) -> Array:
        """Move points (n, 3)."""
        return np.asarray(points @ self.rotation.T + self.shift)


def planes_of(
    points: Array, tolerance: float, *, least_share: float = 0.05, most: int = 8, seed: int = 0
) -> list[PlaneSeen]:
    """Find the planes in a cloud (n, 3), the one with most points first: RANSAC on what no plane has yet.

    Parameters
    ----------
    tolerance : distance from a plane within which points belong to it. It should be 3 or more times their
        noise, and be small against the space between parallel faces.
    least_share : of the cloud's points, below which a plane is not one. Points at random in a box have a
        share of about 2 × tolerance / height within any plane: it has to be well above that.
    most : planes. seed : of the random draws.
    """
    import open3d

    planes: list[PlaneSeen] = []
    free = np.arange(len(points))
    least = max(3, int(np.ceil(least_share * len(points))))
    open3d.utility.random.seed(seed)
    while len(planes) < most and len(free) >= least:
        share = min(least / len(free), 0.99)
        trials = int(np.ceil(np.log(MISSED) / np.log1p(-(share**3))))
        _, inside = _cloud(points[free]).segment_plane(tolerance, 3, trials)
        if len(inside) < least:
            break
        seen = _settled(points, free, np.asarray(inside), tolerance)
        if seen is None or len(seen.members) < least:
            break
        planes.append(seen)
        free = np.setdiff1d(free, seen.members, assume_unique=True)
    return sorted(planes, key=lambda seen: -len(seen.members))


def _settled(points: Array, free: np.ndarray, inside: np.ndarray, tolerance: float) -> PlaneSeen | None:
    """Fit the plane of ``inside``, rows of ``free``, and take the points about it, until these stay."""
    cloud = points[free]
    try:
        plane = fit_plane(cloud[inside])
        for _ in range(SETTLED):
            again = np.flatnonzero(np.abs(plane.deviations(cloud)) <= tolerance)
            if np.array_equal(again, inside):
                break
            inside, plane = again, fit_plane(cloud[again])
        sides = face_sides(cloud[inside], placed=False)
    except ValueError:  # points on a line are no plane
        return None
    rms = float(np.sqrt(np.mean(plane.deviations(cloud[inside]) ** 2)))
    return PlaneSeen(plane, free[inside], sides, rms)


def clusters_of(points: Array, distance: float, *, least: int = LEAST_GROUP) -> np.ndarray:
    """Return the number (n,) of the group that each point of a cloud (n, 3) belongs to, 0 for the largest.

    Groups are further than ``distance`` apart (DBSCAN with at least ``least`` points about each core point);
    -1 for points of no group.
    """
    label = np.asarray(_cloud(points).cluster_dbscan(distance, least))
    size = np.bincount(label[label >= 0], minlength=1)
    # of groups of one size, the one whose first point comes first
    rank = np.argsort(np.argsort(-size, kind="stable"), kind="stable")
    return np.where(label >= 0, rank[label], -1)


def outliers_of(points: Array, *, neighbours: int = NEIGHBOURS, further: float = FURTHER) -> np.ndarray:
    """Mask (n,) of the points whose mean distance to their ``neighbours`` stands out of the cloud's.

    It stands out by more than ``further`` standard deviations above the mean over the cloud.
    """
    _, kept = _cloud(points).remove_statistical_outlier(neighbours, further)
    mask = np.ones(len(points), dtype=bool)
    mask[np.asarray(kept, dtype=int)] = False
    return mask


def register_clouds(
    moving: Array,
    fixed: Array,
    reach: float,
    start: tuple[Array, Array] | None = None,
    *,
    neighbours: int = NEIGHBOURS,
) -> Pose:
    """Move a cloud (n, 3) onto another (m, 3) by their surfaces: iterated closest points, point to plane.

    Parameters
    ----------
    reach : distance within which points of the clouds are paired, after the motion to start from.
    start : rotation (3, 3) and shift (3,) to start from; none moved.
    neighbours : points of the fixed cloud that its surface is fitted to at each point.

    Raises
    ------
    ValueError
        Where no points come within reach, or the surfaces leave a direction free that no pairs determine.
    """
    import open3d

    reg = open3d.pipelines.registration
    begin = np.eye(4)
    if start is not None:
        begin[:3, :3], begin[:3, 3] = start
    target = _cloud(fixed)
    target.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(neighbours))
    way = reg.TransformationEstimationPointToPlane()
    until = reg.ICPConvergenceCriteria(1e-12, 1e-12, 200)
    registered = reg.registration_icp(_cloud(moving), target, reach, begin, way, until)
    pairs = np.asarray(registered.correspondence_set)
    if len(pairs) < 6:
        raise ValueError(f"{len(pairs)} points of the clouds come within {reach:g} of each other")
    motion = np.asarray(registered.transformation)
    moved = moving[pairs[:, 0]] @ motion[:3, :3].T + motion[:3, 3]
    normal = np.asarray(target.normals)[pairs[:, 1]]
    _check_determined(moved, normal)
    apart = np.einsum("nk,nk->n", moved - fixed[pairs[:, 1]], normal)
    spread = float(np.median(np.abs(apart)) / NORMAL_MEDIAN)
    return Pose(motion[:3, :3].copy(), motion[:3, 3].copy(), len(pairs) / len(moving), spread)


def _check_determined(points: Array, normal: Array) -> None:
    """Raise ValueError where the pairs leave a motion of the cloud (n, 3) free: a lone plane slides."""
    about = points - points.mean(axis=0)
    turns = np.cross(about, normal) / np.sqrt((about**2).sum(axis=1).mean())
    value = np.linalg.eigvalsh(np.column_stack([turns, normal]).T @ np.column_stack([turns, normal]))
    if value[0] < FREE * value[-1]:
        raise ValueError("the surfaces do not determine the pose: they slide or turn on each other")


def _cloud(points: Array) -> Any:
    import open3d

    return open3d.geometry.PointCloud(open3d.utility.Vector3dVector(np.ascontiguousarray(points, float)))
