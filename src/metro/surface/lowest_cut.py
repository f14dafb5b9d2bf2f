"""The lowest of the cuts that went over a place: it finishes the place, and those nearly as low with it."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from metro.compiled import compiled_with_arrays
from metro.units import UM, Array

KINK = 0.1 * UM  # cuts whose heights differ by less finish a place together: teeth are less even than that
NOTHING = -69.0  # logarithm of a share that is none: 1e-30


@compiled_with_arrays
def lowest_cut(height: Array, valid: npt.NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return the share of each cut in finishing each place, (n, k), and the height of the places, (n,) m.

    The lowest one finishes a place. Where two are nearly as low both do, and the place is a little lower than
    either, −KINK log Σ exp(−height / KINK): so a face changes smoothly with every parameter, and its
    derivatives are the means of those of the cuts by their shares. All cuts over a place that has no valid
    one finish it alike.

    Parameters
    ----------
    height : (n, k) of the cuts, m. valid : (n, k) whether there is such a cut.
    """
    places, cuts = height.shape
    share, finished = np.zeros_like(height), np.empty(places)
    for i in range(places):
        least, found = np.inf, False
        for k in range(cuts):
            if valid[i, k] and height[i, k] < least:
                least, found = height[i, k], True
        total = 0.0
        for k in range(cuts):
            if not found:
                share[i, k] = 1.0
            elif valid[i, k]:
                exponent = (least - height[i, k]) / KINK
                share[i, k] = math.exp(exponent) if exponent > NOTHING else 0.0
            total += share[i, k]
        mean = 0.0
        for k in range(cuts):
            share[i, k] /= total
            mean += share[i, k] * height[i, k]
        finished[i] = least - KINK * math.log(total) if found else mean
    return share, finished
