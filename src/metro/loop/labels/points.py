"""Points of a unit cube in which the prior of the parameters is uniform, and clouds of more about some."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from metro.effects.effect import EffectParameter
from metro.units import Array

_MOST, _MOST_EACH = 256, 64  # points of a set, and of each parameter
_CENTRES, _LEAST_WIDTH = 64, 0.02  # of clouds, in the unit cube


def count_of(size: int) -> int:
    """Points of a set, for so many parameters."""
    return min(_MOST, _MOST_EACH * size)


def thinned(weights: Array, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return indices (count,) of points, evenly by weight."""
    share = (np.arange(count) + rng.random()) / count
    chosen: np.ndarray = np.searchsorted(np.cumsum(weights), share).clip(max=len(weights) - 1)
    return chosen


def values(parameters: Sequence[EffectParameter], cube: Array) -> Array:
    """Parameters (t, n) at points (t, d) of the cube, which has no coordinate for what is given."""
    sought = iter(cube.T)
    columns = [np.full(len(cube), p.lower) if p.given else quantile(p, next(sought)) for p in parameters]
    return np.stack(columns, axis=1)


def quantile(parameter: EffectParameter, share: Array) -> Array:
    """Value of a parameter below which its prior has a ``share`` (n,).

    A choice: each alike. Plausible about zero: normal within the bounds. Positive: flat in the logarithm.
    """
    from scipy.special import ndtr, ndtri

    low, high = parameter.lower, parameter.upper
    if parameter.choices:
        return np.minimum(np.floor(share * len(parameter.choices)), len(parameter.choices) - 1.0)
    if parameter.plausible is not None:
        below, above = ndtr(np.array([low, high]) / parameter.plausible)
        return np.asarray(parameter.plausible * ndtri(below + share * (above - below)))
    if low > 0.0:
        return np.asarray(low * (high / low) ** share)
    return low + share * (high - low)


@dataclass(frozen=True)
class Nearby:
    """Normal clouds about points (h, c), folded back at the faces of the cube; ``width`` (c,).

    They determine its first c coordinates; the others are uniform.
    """

    centres: Array
    width: Array

    def drawn(self, rng: np.random.Generator, size: int) -> Array:
        """Points (n, size)."""
        points = rng.random((count_of(size), size))
        near = self.centres[rng.integers(len(self.centres), size=len(points))]
        near = near + self.width * rng.standard_normal(near.shape)
        points[:, : near.shape[1]] = 1.0 - np.abs(1.0 - near % 2.0)
        return points

    def density(self, cube: Array) -> Array:
        """Density (t,) at points (t, d)."""
        at = cube[:, None, : self.centres.shape[1]]
        images = (self.centres, -self.centres, 2.0 - self.centres)
        near = sum((np.exp(-0.5 * ((at - image) / self.width) ** 2) for image in images), np.zeros(1))
        peak = np.prod(self.width * np.sqrt(2.0 * np.pi))
        density: Array = near.prod(axis=2).mean(axis=1) / peak
        return density


def about(weights: Array, cube: Array, rng: np.random.Generator) -> Nearby:
    """Clouds about points (t, d) by their weights (t,)."""
    spread = np.sqrt(weights @ (cube - weights @ cube) ** 2)
    width = spread * (np.sum(weights**2)) ** (1.0 / (4 + cube.shape[1]))  # Silverman's rule
    return Nearby(cube[thinned(weights, _CENTRES, rng)], np.clip(width, _LEAST_WIDTH, 0.5))
