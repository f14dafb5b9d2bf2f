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
    apart = (at[:, None] - at[None]) ** 2
    lengths = np.full(at.shape[1], 0.5)
    for _ in range(_SWEEPS):
        for i in range(len(lengths)):
            tried = [np.where(np.arange(len(lengths)) == i, length, lengths) for length in _LENGTHS]
            lengths = max(tried, key=lambda one: _whitened(apart, values, one).log_likelihood)
    found = _whitened(apart, values, lengths)
    inverse = found.whitening.T @ found.whitening
    return Kriged(at, lengths, found.trend, found.variance, inverse @ (values - found.trend), inverse)


@dataclass(frozen=True)
class _Whitened:
    """What makes independent numbers of the values (n, n), their trend and variance (p,), log-likelihood."""

    whitening: Array
    trend: Array
    variance: Array
    log_likelihood: float


def _whitened(apart: Array, values: Array, lengths: Array) -> _Whitened:
    """Whiten values (n, p) at points whose coordinates are ``apart`` (n, n, d), squared."""
    lower = np.linalg.cholesky(_matern(apart @ lengths**-2.0) + _NUGGET * np.eye(len(values)))
    whitening = np.linalg.inv(lower)
    one, white = whitening.sum(axis=1), whitening @ values
    trend = one @ white / (one @ one)
    variance = np.maximum(np.mean((white - np.outer(one, trend)) ** 2, axis=0), _LEAST_SD**2)
    log_determinant = 2.0 * np.log(np.diag(lower)).sum()
    log_likelihood = -0.5 * float(len(values) * np.log(variance).sum() + len(variance) * log_determinant)
    return _Whitened(whitening, trend, variance, log_likelihood)


def _covariance(first: Array, second: Array, lengths: Array) -> Array:
    return _matern(np.sum(((first[:, None] - second[None]) / lengths) ** 2, axis=2))


def _matern(squared: Array) -> Array:
    """Covariance at squared distances, in lengths."""
    distance = np.sqrt(3.0 * squared)
    covariance: Array = (1.0 + distance) * np.exp(-distance)
    return covariance
