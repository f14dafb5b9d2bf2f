"""Series along a path as waves, in which noise with long waves is independent, and its level."""

from __future__ import annotations

import numpy as np

from metro.signals.intervals import places
from metro.units import Array

SMOOTH = 5  # polynomial terms that a level may have: gravity and friction along one path
LEVELS = np.concatenate([[0.0], np.geomspace(1e-2, 1e3, 51)])


def waves(series: Array) -> Array:
    """Return the waves (m, k) of series (m, k): orthonormal cosines, wave i of i half-waves."""
    from scipy.fft import dct

    return np.asarray(dct(series, axis=0, norm="ortho"), dtype=float)


def variance(count: int, white: Array, wander: Array) -> Array:
    """Variance (count, k) of the waves of white noise (k,) and of noise in proportion to the wave's length.

    Wave i has ``white + wander / i``; the mean that of a wave twice as long as the longest.
    """
    number = np.maximum(np.arange(count, dtype=float), 0.5)
    return np.asarray(white + np.outer(1.0 / number, wander))


def wandering(series: Array, white: Array, steps: Array, interval: Array | None = None) -> Array:
    """Estimate the level (k,) of the noise whose variance goes with the length of the wave.

    Likeliest value, waves taken as independent and normal (Whittle); the longest waves are left to the
    signal.

    Parameters
    ----------
    series : (m, k) smooth levels in noise. white : (k,) variance of the white noise, known.
    steps : (m, j) shapes that the levels may have beside a polynomial (a friction that changes its sign).
    interval : (m - 1,) of levels that are not even (:func:`metro.signals.intervals.uneven`): the smooth level
        is one over the places, not over the count.
    """
    count, channels = series.shape
    if count < 4 * SMOOTH:
        return np.zeros(channels)
    place = places(count, interval)
    shapes = np.column_stack([np.polynomial.legendre.legvander(place, SMOOTH - 1), steps])
    level = shapes @ np.linalg.lstsq(shapes, series, rcond=None)[0]
    power = waves(series - level)[SMOOTH:] ** 2
    grid = LEVELS[:, None] * white
    spread = np.stack([variance(count, white, level)[SMOOTH:] for level in grid])
    likelihood = -(np.log(spread) + power / spread).sum(axis=1)
    best = np.argmax(likelihood, axis=0)
    return np.asarray(np.take_along_axis(grid, best[None], axis=0)[0])
