"""What a model says where it was not solved, from where it was, with how sure that is.

Ordinary kriging with a Matérn 3/2 covariance (Rasmussen and Williams, Gaussian Processes for Machine
Learning, 2006, ch. 2 and 5): all values share its lengths, one per coordinate, of the highest likelihood.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array

_LENGTHS = (0.06, 0.12, 0.25, 0.5, 1.0, 2.0, 4.0)
_SWEEPS = 2
_NUGGET = 1e-4  # share of the variance that is not smooth
_LEAST_SD = 1e-3


@dataclass(frozen=True)
class Kriged:
    """Values between the points where they are known.

    Attributes
    ----------
    at : (n, d) points of the unit cube. lengths : (d,). trend, variance : (p,) of the values.
    weights : (n, p) of the covariances with the points. inverse : (n, n) of their covariances.
    """

    at: Array
    lengths: Array
    trend: Array
    variance: Array
    weights: Array
    inverse: Array

    def __call__(self, cube: Array) -> tuple[Array, Array]:
        """Means and standard deviations (t, p) at points (t, d)."""
        shared = _covariance(cube, self.at, self.lengths)
        unknown = 1.0 - np.sum((shared @ self.inverse) * shared, axis=1)
        sd = np.sqrt(np.clip(unknown, 0.0, 1.0)[:, None] * self.variance)
        return self.trend + shared @ self.weights, sd

    def left_out(self) -> tuple[Array, Array]:
        """Errors and standard deviations (n, p) of each value as predicted by the others, the trend kept.

        Dubrule (1983): both are in the inverse of the covariances, without solving anew.
        """
        own = np.diag(self.inverse)[:, None]
        return -self.weights / own, np.sqrt(self.variance / own)

    def nearest(self, cube: Array) -> np.ndarray:
        """Index (t,) of the known point that has most in common with each."""
        nearest: np.ndarray = _covariance(cube, self.at, self.lengths).argmax(axis=1)
        return nearest


def krige(at: Array, values: Array) -> Kriged:
    """Learn values (n, p) that are known at points (n, d) of the unit cube."""
    lengths = np.full(at.shape[1], 0.5)
    for _ in range(_SWEEPS):
        for i in range(len(lengths)):
            tried = [np.where(np.arange(len(lengths)) == i, length, lengths) for length in _LENGTHS]
            lengths = max(tried, key=lambda one: _log_likelihood(at, values, one))
    inverse, trend, variance, _ = _solved(at, values, lengths)
    return Kriged(at, lengths, trend, variance, inverse @ (values - trend), inverse)


def _log_likelihood(at: Array, values: Array, lengths: Array) -> float:
    _, _, variance, log_determinant = _solved(at, values, lengths)
    return -0.5 * float(len(at) * np.log(variance).sum() + len(variance) * log_determinant)


def _solved(at: Array, values: Array, lengths: Array) -> tuple[Array, Array, Array, float]:
    """Inverse covariance, trend and variance of each value, log determinant."""
    covariance = _covariance(at, at, lengths) + _NUGGET * np.eye(len(at))
    inverse: Array = np.asarray(np.linalg.inv(covariance), dtype=float)
    total = inverse.sum(axis=0)
    trend = total @ values / total.sum()
    residual = values - trend
    variance = np.maximum(
        np.einsum("np,nm,mp->p", residual, inverse, residual, optimize=True) / len(at), _LEAST_SD**2
    )
    return inverse, trend, variance, float(np.linalg.slogdet(covariance)[1])


def _covariance(first: Array, second: Array, lengths: Array) -> Array:
    squared = np.sum(((first[:, None] - second[None]) / lengths) ** 2, axis=2)
    distance = np.sqrt(3.0 * squared)
    covariance: Array = (1.0 + distance) * np.exp(-distance)
    return covariance
