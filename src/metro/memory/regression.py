"""Weighted regression of measured values y ± s over a known course, with scatter between batches.

y = X b + scatter + error. The error's deviation s is known; that of the scatter, τ, is not. The regression
coefficients are integrated out, and so is τ, by its restricted likelihood with a prior that is flat in τ
(Gelman, Bayesian Anal. 1 (2006) 515). With few batches τ is hardly known, and an interval that takes its best
estimate for the truth is too short. The prediction is a mixture of normal distributions over τ and over the
courses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array

_GRID = 60  # values of τ
_MOST = 6.0  # times the deviation of y: the largest τ
_NEGLIGIBLE = 1e-4  # parts of a mixture with a smaller weight than this one are dropped
_BISECTIONS = 40


@dataclass(frozen=True)
class Regression:
    """Courses (k), each fitted to n batches at g values of τ.

    Attributes
    ----------
    tau : (g,) deviation between batches.
    beta : (k, g, p). covariance : (k, g, p, p).
    log_likelihood : (k,) maximum over τ. share : (k, g) posterior weights of τ, adding up to one.
    """

    tau: Array
    beta: Array
    covariance: Array
    log_likelihood: Array
    share: Array


@dataclass(frozen=True)
class Mixture:
    """Normal distributions of m parts, for each of q values: ``weight`` (m,), ``mean`` and ``sd`` (m, q)."""

    weight: Array
    mean: Array
    sd: Array

    def below(self, value: Array) -> Array:
        """Probability (q,) of less than ``value`` (q,)."""
        from scipy.special import ndtr

        return np.asarray(self.weight @ ndtr((value - self.mean) / self.sd))

    def quantile(self, probability: float) -> Array:
        """Values (q,) below which the distributions have ``probability``; by bisection."""
        low = (self.mean - 12.0 * self.sd).min(axis=0)
        high = (self.mean + 12.0 * self.sd).max(axis=0)
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            less = self.below(middle) < probability
            low, high = np.where(less, middle, low), np.where(less, high, middle)
        return np.asarray(0.5 * (low + high))

    def interval(self) -> tuple[Array, Array, Array]:
        """Low, median and high (q,) of the central 95 %."""
        low, middle, high = (self.quantile(p) for p in (0.025, 0.5, 0.975))
        return low, middle, high


def regress(designs: Array, y: Array, s: Array) -> Regression:
    """Fit y (n,) with errors s (n,) by each of the designs (k, n, p), at every τ of a grid.

    The likelihood is marginal over the scatter; the restricted one omits the terms that do not depend on τ.
    """
    tau = _MOST * max(float(np.std(y)), float(np.min(s))) * np.linspace(0.0, 1.0, _GRID) ** 2
    variance = s**2 + tau[:, None] ** 2  # (g, n)
    normal = np.einsum("knp,gn,knq->kgpq", designs, 1.0 / variance, designs)
    covariance = np.linalg.inv(normal)
    beta = np.einsum("kgpq,knq,gn->kgp", covariance, designs, y / variance)
    residual = y - np.einsum("knp,kgp->kgn", designs, beta)
    log_likelihood = -0.5 * np.sum(np.log(2.0 * np.pi * variance) + residual**2 / variance, axis=2)
    restricted = log_likelihood - 0.5 * np.linalg.slogdet(normal)[1]
    cell = np.gradient(tau)
    share = np.exp(restricted - restricted.max(axis=1, keepdims=True)) * cell
    share /= share.sum(axis=1, keepdims=True)
    return Regression(tau, beta, covariance, log_likelihood.max(axis=1), share)


def mixture(
    fitted: Regression, rows: Array, weight: Array, *, scatter: bool = False, error: float = 0.0
) -> Mixture:
    """Return the mixture of the courses at q places, with their weights ``weight`` (k,).

    Parameters
    ----------
    rows : (k, q, p) rows of the designs at these places.
    scatter : whether the values are those of a single batch rather than of the course itself.
    error : deviation of the measurement of a batch.
    """
    parts = (weight[:, None] * fitted.share).ravel()
    kept = parts > _NEGLIGIBLE * parts.max()
    mean = np.einsum("kqp,kgp->kgq", rows, fitted.beta)
    variance = np.einsum("kqp,kgpr,kqr->kgq", rows, fitted.covariance, rows) + error**2
    if scatter:
        variance = variance + fitted.tau[None, :, None] ** 2
    q = rows.shape[1]
    share = parts[kept] / parts[kept].sum()
    return Mixture(share, mean.reshape(-1, q)[kept], np.sqrt(variance.reshape(-1, q)[kept]))


def level(y: Array, s: Array) -> tuple[Mixture, float]:
    """Return the mean of batches y ± s (n,), and the two-sided p-value of zero."""
    ones = np.ones((1, len(y), 1))
    mean = mixture(regress(ones, y, s), np.ones((1, 1, 1)), np.ones(1))
    below = float(mean.below(np.zeros(1))[0])
    return mean, 2.0 * min(below, 1.0 - below)
