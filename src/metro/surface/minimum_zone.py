"""The minimum zone: the least distance of two parallel planes that hold all points (ISO 12781-1).

In a frame whose z is near the zone's normal, the zone is a linear programme in four unknowns (two slopes, two
heights). It is solved on a working set of a few points; all points are then checked, the worst added, and so
on until the zone of the working set, a lower bound, is the zone of all points, an upper bound. The slopes
turn the frame, and a last programme in the turned frame makes the orthogonal width exact. (A search over the
facets of the convex hull alone misses the zones that touch two points on each side.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.surface.plane import fit_plane
from metro.units import Array

CERTIFIED = 1e-12  # upper minus lower bound, relative to the range of heights
FLAT = 0.2  # least over middle principal extent below which the normal of the fitted plane is the only start


@dataclass(frozen=True)
class MinimumZone:
    """The zone: its width, unit normal (3,), the points it touches, and the bounds that certify it.

    ``upper`` and ``lower`` are indices into the points; ``bound`` is the proven lower bound on the width
    among the zones near this one; ``passes`` counts the programmes solved.
    """

    width: float
    bound: float
    normal: Array
    upper: np.ndarray
    lower: np.ndarray
    passes: int


def minimum_zone(points: Array) -> MinimumZone:
    """Return the minimum zone of ``points`` (n, 3) in their unit.

    For a set that is not flat (a box, a polyhedron) several zones are least among their neighbours: thirteen
    directions are tried and the least is returned, without proof that it is the least of all.

    Raises
    ------
    ValueError
        Where the points define no plane.
    """
    plane = fit_plane(points)
    frame = np.vstack([plane.axes, plane.normal])
    centred = points - plane.point
    extents = np.ptp(centred @ frame.T, axis=0)
    if extents[2] <= FLAT * extents[1]:
        return _descend(centred, plane.normal)
    return min((_descend(centred, start @ frame) for start in _directions()), key=lambda zone: zone.width)


def vertical_zone(points: Array, start: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the zone's width along z, and the points that were tried, of ``points`` (n, 3) of order 1.

    ``start``: indices of points that are likely to touch.
    """
    _, gap, _, working, _ = _vertical_zone(points, start)
    return gap, working


def _directions() -> Array:
    """Return unit vectors to faces, edges and corners of a cube, one of each opposite pair, (13, 3)."""
    steps = np.array(np.meshgrid([-1, 0, 1], [-1, 0, 1], [-1, 0, 1])).reshape(3, -1).T[14:].astype(float)
    return np.asarray(steps / np.linalg.norm(steps, axis=1, keepdims=True))


def _descend(points: Array, normal: Array) -> MinimumZone:
    """Turn the frame until the zone's slopes in it vanish: each programme can only narrow the zone."""
    working = np.empty(0, dtype=np.intp)
    passes = 0
    for _ in range(60):
        frame = _frame(normal)
        local = points @ frame.T
        reach = float(np.abs(local[:, :2]).max())
        half = max(float(np.ptp(local[:, 2])) / 2, np.finfo(float).tiny)
        scaled = local / np.array([reach, reach, half])
        slopes, gap, bound, working, used = _vertical_zone(scaled, working)
        passes += used
        turned = np.array([*(-slopes * half / reach), 1.0])
        length = float(np.linalg.norm(turned))
        normal = turned @ frame / length
        if length - 1 <= 1e-15:
            break
    heights = points @ normal
    tolerance = 1e-9 * 2 * half
    upper = working[heights[working] >= heights.max() - tolerance]
    lower = working[heights[working] <= heights.min() + tolerance]
    return MinimumZone(gap * half / length, bound * half / length, normal, upper, lower, passes)


def _frame(normal: Array) -> Array:
    """Rows: two directions across the unit ``normal``, and itself."""
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    across /= np.linalg.norm(across)
    return np.vstack([across, np.cross(normal, across), normal])


def _vertical_zone(points: Array, working: np.ndarray) -> tuple[Array, float, float, np.ndarray, int]:
    """Return slopes (2,), gap over all points, lower bound, working set, programmes; points of order 1."""
    working = np.union1d(working, _spread_extremes(points))
    for used in range(1, 200):
        slopes, low, high = _programme(points[working])
        heights = points[:, 2] - points[:, :2] @ slopes
        gap, bound = float(np.ptp(heights)), high - low
        if gap - bound <= CERTIFIED:
            return slopes, gap, bound, working, used
        outside = np.flatnonzero((heights > high) | (heights < low))
        added = np.union1d(working, _worst_per_quadrant(points, heights, outside))
        if len(added) == len(working):
            break  # the remaining change is rounding, far below the scale of the data
        working = added
    return slopes, gap, bound, working, used


def _spread_extremes(points: Array) -> np.ndarray:
    """Highest and lowest point, as seen flat and from six slopes: up to fourteen indices."""
    angles = np.arange(6) * np.pi / 3
    slopes = np.vstack([np.zeros(2), 0.5 * np.column_stack([np.cos(angles), np.sin(angles)])])
    heights = (points[:, 2] - points[:, :2] @ slope for slope in slopes)
    return np.unique([index for height in heights for index in (height.argmax(), height.argmin())])


def _worst_per_quadrant(points: Array, heights: Array, outside: np.ndarray) -> np.ndarray:
    quadrant = 2 * (points[outside, 0] > 0) + (points[outside, 1] > 0)
    members = [outside[quadrant == number] for number in range(4)]
    extremes = [(m[heights[m].argmax()], m[heights[m].argmin()]) for m in members if len(m)]
    return np.array([*extremes, (heights.argmax(), heights.argmin())]).ravel()


def _programme(points: Array) -> tuple[Array, float, float]:
    """Least high − low with low ≤ z − a x − b y ≤ high: slopes (a, b), low, high, exact on the contacts."""
    from scipy.optimize import linprog

    x, y, z = points.T
    one, none = np.ones_like(z), np.zeros_like(z)
    below = np.column_stack([x, y, one, none])  # a x + b y + low ≤ z
    above = np.column_stack([-x, -y, none, -one])
    solved = linprog(
        c=[0.0, 0.0, -1.0, 1.0],
        A_ub=np.vstack([below, above]),
        b_ub=np.concatenate([z, -z]),
        bounds=(None, None),
        method="highs-ds",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    touching_low = z - below @ solved.x < 1e-9
    touching_high = -z - above @ solved.x < 1e-9
    contacts = np.vstack([below[touching_low], -above[touching_high]])
    exact = np.linalg.lstsq(contacts, np.concatenate([z[touching_low], z[touching_high]]), rcond=None)[0]
    # with fewer than four contacts the slopes are not unique: keep the solver's
    a, b, low, high = exact if len(contacts) >= 4 else solved.x
    return np.array([a, b]), float(low), float(high)
