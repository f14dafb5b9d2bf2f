"""How large a scanned face is, and whether that size agrees with the declared unit of length and part."""

from __future__ import annotations

import numpy as np

from metro.surface.plane import fit_plane
from metro.units import Array

FAR = 3.0  # times the median distance from the middle: a rectangle's corner is at 2.0 at most
UNITS = {"metres": 1e3, "inches": 25.4, "centimetres": 10.0, "micrometres": 1e-3}  # mm


def face_sides(points: Array, *, placed: bool) -> Array:
    """Return the sides (2,) of the rectangle about a cloud (n, 3), points far from all others left out.

    Parameters
    ----------
    placed : the cloud is in the work frame: its sides are those along x and y. Otherwise they are those of
        the smallest rectangle about it in its plane, longest first.

    Raises
    ------
    ValueError
        Where the points define no plane.
    """
    from scipy.spatial import ConvexHull, QhullError

    distance = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    near = points[distance <= FAR * np.median(distance)]
    if placed:
        return np.asarray(np.ptp(near[:, :2], axis=0))
    flat = fit_plane(near).coordinates(near)
    try:
        hull = flat[ConvexHull(flat).vertices]
    except QhullError as error:
        raise ValueError("the points lie on a line: they have no sides") from error
    # one side of the smallest rectangle about a convex polygon lies on an edge of it (Freeman & Shapira 1975)
    edges = np.roll(hull, -1, axis=0) - hull
    along = edges / np.linalg.norm(edges, axis=1)[:, None]
    across = np.column_stack([-along[:, 1], along[:, 0]])
    spans = np.stack([np.ptp(hull @ along.T, axis=0), np.ptp(hull @ across.T, axis=0)], axis=1)
    return np.sort(spans[np.argmin(spans.prod(axis=1))])[::-1]


def misfit(sides: Array, low: Array, high: Array) -> str | None:
    """Explain why ``sides`` (k,) in mm are not within ``low`` and ``high`` (k,).

    Returns
    -------
    str or None
        The unit that the coordinates seem to be in, "" where no unit explains the size, None where it fits.
    """
    if _within(sides, low, high):
        return None
    return next((unit for unit, size in UNITS.items() if _within(sides * size, low, high)), "")


def misread(sides: Array, low: Array, high: Array) -> str:
    """Return the unit that millimetres were taken for, where that explains a wrong size; else ""."""
    return next((unit for unit, size in UNITS.items() if _within(sides / size, low, high)), "")


def extents(points: Array, *, placed: bool) -> Array:
    """Return the sizes (3,) of a cloud (n, 3): its sides, and its height from the plane through it.

    Raises
    ------
    ValueError
        Where the points define no plane.
    """
    sides = face_sides(points, placed=placed)
    return np.append(sides, np.ptp(fit_plane(points).deviations(points)))


def _within(sides: Array, low: Array, high: Array) -> bool:
    return bool((sides >= low).all() and (sides <= high).all())
