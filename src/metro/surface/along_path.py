"""Deviations point by point along a path: absolute, arithmetic and geometric ([F] figures 13 to 16).

The source defines X_a and X_g for a whole face, and draws them for every point without saying over how many.
Here they are means over a window of points that is centred on each, shorter at the ends.
"""

from __future__ import annotations

import numpy as np

from metro.surface.indices import log_mean_floor
from metro.units import Array

WINDOW = 5  # points: 10 mm of the printed path
ERRORS = ("absolute", "arithmetic", "geometric")


def errors_along(deviations: Array, step: float, window: int = WINDOW) -> dict[str, Array]:
    """Return |d|, and its arithmetic and geometric mean over ``window`` points about each, (n,) each.

    Parameters
    ----------
    deviations : (n,), in the order of the path. step : rounding of the data, in the same unit; a deviation
        below half of it is not zero but unknown, and enters the logarithm as in X_g.
    """
    size = np.abs(np.asarray(deviations, dtype=float))
    floor = max(log_mean_floor(step), np.finfo(float).tiny)
    known = np.where(size < max(step / 2, floor), floor, size)
    return {
        "absolute": size,
        "arithmetic": running_mean(size, window),
        "geometric": np.exp(running_mean(np.log(known), window)),
    }


def running_mean(values: Array, window: int) -> Array:
    """Mean over the points within ``window`` // 2 of each point, (n,); fewer at the ends."""
    reach = window // 2
    total = np.concatenate([[0.0], np.cumsum(values)])
    place = np.arange(len(values))
    low, high = np.maximum(place - reach, 0), np.minimum(place + reach + 1, len(values))
    return np.asarray((total[high] - total[low]) / (high - low))


def passes_of(place: Array, factor: float = 3.0) -> list[np.ndarray]:
    """Rows of each pass among points (n, 2) in the order of the path.

    A pass ends where the next point is further than ``factor`` times the median distance of neighbours.
    """
    apart = np.linalg.norm(np.diff(place, axis=0), axis=1)
    if not len(apart):
        return [np.arange(len(place))]
    ends = np.flatnonzero(apart > factor * np.median(apart)) + 1
    return np.split(np.arange(len(place)), ends)
