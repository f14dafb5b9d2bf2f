"""Faces cut out of a scan of a whole scene: planes that hold together, and the reasons why others do not.

A plane that cuts through a curved or a tilted surface finds points, too: the wider one looks about it, the
more of them. Of a face, points lie about the plane by their noise and its form, however wide one looks. So
the width is made to follow from the points: ``WIDE`` robust standard deviations of those within it, again and
again. For a face it settles; for a slice of something else, whose points lie evenly within any width (robust
standard deviation 0.74 of the half width), it grows each time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.surface.extent import face_sides
from metro.surface.plane import Plane, fit_plane
from metro.surface.points import Points, Spool, changed, drawn
from metro.surface.scene import LEAST_GROUP, PlaneSeen, clusters_of, planes_of
from metro.units import Array

SEEN = 20_000  # points that a scene is looked at with
PART = 0.05  # of them, that a face must have: fewer do not show a surface
THICK = 0.01  # of the distance of the points from their middle: the widest that a face may be
WIDE = 6.0  # robust standard deviations; of normal noise, 2 points in 10⁹ are further away
APART = 6.0  # times the distance to the tenth neighbour: a wider gap parts two faces
MEDIAN = 1.4826  # standard deviation over median absolute deviation of a normal distribution
ROUNDS = 20
# A slice of a curved surface goes on beside itself: where a plane takes what lies within ± w of a parabola,
# 0.73 times as many points lie beside it within 5 w. Beside a face there are none, or the foot of a wall.
BESIDE, GOES_ON = 5.0, 0.3
CURVED = (
    "its points lie evenly about the plane, the more of them the further one looks, as where a plane cuts "
    "through a curved or a tilted surface"
)


@dataclass(frozen=True, eq=False)
class FaceSeen:
    """A face in a scene; lengths in the unit of the points.

    Attributes
    ----------
    plane : by least squares. places : (k, 2) in it, of the points that it was seen by. sides : (2,) longest
        first. share : of the points of the scene. width : within which its points lie about the plane.
        gap : distance in the plane beyond which a point is of another face.
    """

    plane: Plane
    places: Array
    sides: Array
    share: float
    width: float
    gap: float

    def cut(self, points: Points) -> Spool:
        """Return the points of a cloud (n, 3) that are of this face."""
        from scipy.spatial import cKDTree

        tree = cKDTree(self.places)

        def of_it(some: Array) -> Array:
            near = some[np.abs(self.plane.deviations(some)) <= self.width]
            apart = tree.query(self.plane.coordinates(near))[0]
            return np.asarray(near[apart <= self.gap])

        return changed(points, of_it)


@dataclass(frozen=True, eq=False)
class Scene:
    """The faces of a scene, the largest first, and why other planes in it are none, in words."""

    faces: tuple[FaceSeen, ...]
    refused: tuple[str, ...]


def scene_of(cloud: Points, unit: float) -> Scene:
    """Find the faces in a cloud (n, 3); ``unit``: a millimetre in its unit, for the words."""
    points = np.unique(drawn(cloud, SEEN), axis=0)
    size = float(np.median(np.linalg.norm(points - np.median(points, axis=0), axis=1)))
    planes = planes_of(points, THICK * size, least_share=PART) if size > 0.0 else []
    faces: list[FaceSeen] = []
    refused = []
    for seen in planes:
        found = _settled(points, seen, THICK * size)
        if isinstance(found, str):
            sides = " × ".join(f"{side / unit:.3g}" for side in seen.sides)
            share = 100 * len(seen.members) / len(points)
            refused.append(f"{sides} mm ({share:.0f} % of the points): {found}")
        else:
            faces += found
    return Scene(tuple(sorted(faces, key=lambda face: -face.share)), tuple(refused))


def _settled(points: Array, seen: PlaneSeen, widest: float) -> list[FaceSeen] | str:
    """Return the faces on a plane that are apart from each other, or why there is none."""
    own = points[seen.members]
    plane, width = seen.plane, widest
    for _ in range(ROUNDS):
        far = plane.deviations(own)
        within = np.abs(far) <= width
        spread = MEDIAN * float(np.median(np.abs(far[within] - np.median(far[within]))))
        if WIDE * spread > widest:
            return CURVED
        before, width = width, max(WIDE * spread, float(np.spacing(np.abs(own).max())))
        plane = fit_plane(own[np.abs(far) <= width])
        if abs(width - before) < 1e-3 * before:
            break
    on = own[np.abs(plane.deviations(own)) <= width]
    places = plane.coordinates(on)
    flat = np.column_stack([places, np.zeros(len(places))])
    gap = APART * _tenth(places)
    label = clusters_of(flat, gap)
    counts = np.bincount(label[label >= 0], minlength=1)
    pieces = [label == k for k in range(len(counts)) if counts[k] >= PART * len(points)]
    if not pieces:
        return f"it is in {len(counts)} pieces, each of which has less than {100 * PART:.0f} % of the points"
    whole = [on[piece] for piece in pieces if not _goes_on(points, on[piece], plane, width, gap)]
    return [_face(each, len(points), width, gap) for each in whole] or CURVED


def _goes_on(points: Array, own: Array, plane: Plane, width: float, gap: float) -> bool:
    """Whether beside a piece (k, 3) of a plane, points lie as close to it as a curved surface goes on."""
    from scipy.spatial import cKDTree

    far = np.abs(plane.deviations(points))
    beside = points[(far > width) & (far <= BESIDE * width)]
    if not len(beside):
        return False
    apart = cKDTree(plane.coordinates(own)).query(plane.coordinates(beside))[0]
    return bool(np.count_nonzero(apart <= gap) > GOES_ON * len(own))


def _tenth(places: Array) -> float:
    """Return the median distance of points (n, 2) to the tenth neighbour."""
    from scipy.spatial import cKDTree

    return float(np.median(cKDTree(places).query(places, k=[min(LEAST_GROUP + 1, len(places))])[0]))


def _face(points: Array, of: int, width: float, gap: float) -> FaceSeen:
    plane = fit_plane(points)
    sides = face_sides(points, placed=False)
    return FaceSeen(plane, plane.coordinates(points), sides, len(points) / of, width, gap)
