"""Ranking of configurations: which is best, how surely, and whether a prediction ranks them alike.

The means of configurations on a log scale, with the scatter of a run pooled over all, have a multivariate t
distribution given the runs (flat prior; Box & Tiao, Bayesian Inference in Statistical Analysis, ch. 2); draws
from it show how often each is the least.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from metro.units import Array

DRAWS = 4000
SURE = 0.975  # probability of an order of two configurations that is called sure
EXACT = 7  # configurations up to which all orders are gone through; beyond, so many are drawn


def posterior_draws(mean: Array, covariance: Array, dof: float, draws: int = DRAWS, seed: int = 1) -> Array:
    """Draw means (draws, k) from the multivariate t of ``mean`` (k,), ``covariance`` (k, k) and ``dof``."""
    rng = np.random.default_rng(seed)
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    scale = np.sqrt(dof / rng.chisquare(dof, draws)) if math.isfinite(dof) else np.ones(draws)
    return np.asarray(mean + scale[:, None] * (rng.standard_normal((draws, len(mean))) @ root.T))


def probability_best(draws: Array) -> Array:
    """Share of ``draws`` (draws, k) in which each of k configurations is the least."""
    return np.bincount(draws.argmin(axis=1), minlength=draws.shape[1]) / len(draws)


@dataclass(frozen=True)
class Agreement:
    """How far two rankings agree.

    Attributes
    ----------
    spearman, interval : rank correlation; ``interval`` None where too little is known for one.
    p_value : share of all orders of the configurations that agree at least as well.
    pairs, alike : pairs of configurations, and the share that both rank alike (ties count half).
    sure_pairs, sure_alike : the same among pairs whose measured order is sure; None where not known.
    """

    spearman: float
    interval: tuple[float, float] | None
    p_value: float
    pairs: int
    alike: float
    sure_pairs: int | None = None
    sure_alike: float | None = None


def agreement(
    predicted: Array,
    measured: Array,
    measured_draws: Array | None = None,
    predicted_draws: Array | None = None,
    seed: int = 1,
) -> Agreement:
    """Compare two rankings of the same k > 2 configurations.

    Parameters
    ----------
    predicted, measured : (k,). ``measured_draws``, ``predicted_draws``: (draws, k) from what is known of
        them: the interval then is what the scatter of the runs (and the error of the prediction) leaves
        open. Without draws it is that of Bonett & Wright (Psychometrika 65 (2000) 23), for configurations
        like these.
    """
    rho = float(spearman(predicted, measured))
    if measured_draws is None:
        sure, interval = None, _bonett_wright(rho, len(measured))
    else:
        other = (
            np.broadcast_to(predicted, measured_draws.shape) if predicted_draws is None else predicted_draws
        )
        correlations = [spearman(p, m) for p, m in zip(other, measured_draws, strict=True)]
        low, high = np.quantile(correlations, [0.025, 0.975])
        interval, sure = (float(low), float(high)), _sure_pairs(measured_draws)
    score = _alike(predicted, measured)
    upper = np.triu_indices(len(measured), 1)
    counted = int(sure.sum()) if sure is not None else None
    return Agreement(
        rho,
        interval,
        _permutation_p(predicted, measured, seed),
        len(upper[0]),
        float(score[upper].mean()),
        counted,
        float(score[sure].mean()) if sure is not None and counted else None,
    )


def spearman(first: Array, second: Array) -> Array:
    """Rank correlation along the last axis, ties at their mean rank; NaN where all of either are equal."""
    from scipy.stats import rankdata

    a, b = (
        rankdata(values, axis=-1) - (values.shape[-1] + 1) / 2
        for values in (np.asarray(first), np.asarray(second))
    )
    size = np.sqrt((a**2).sum(axis=-1) * (b**2).sum(axis=-1))
    return np.where(size > 0, (a * b).sum(axis=-1) / np.where(size > 0, size, 1.0), np.nan)


def _alike(first: Array, second: Array) -> Array:
    """Return 1 where two rankings order a pair alike, 0 where not, 1/2 where one of them ties, (k, k)."""
    product = np.sign(first[:, None] - first) * np.sign(second[:, None] - second)
    return np.asarray((product + 1) / 2)


def _sure_pairs(draws: Array) -> np.ndarray:
    """Which pairs (upper triangle) are in the same order in nearly all draws, (k, k)."""
    share = np.mean(draws[:, :, None] < draws[:, None, :], axis=0)
    return np.asarray(np.triu(np.maximum(share, 1 - share) >= SURE, 1))


def _bonett_wright(rho: float, count: int) -> tuple[float, float] | None:
    if count < 4 or not abs(rho) < 1:
        return None
    half = 1.959963984540054 * math.sqrt((1 + rho**2 / 2) / (count - 3))
    return math.tanh(math.atanh(rho) - half), math.tanh(math.atanh(rho) + half)


def _permutation_p(first: Array, second: Array, seed: int) -> float:
    """Share of orders of ``second`` whose rank correlation with ``first`` is at least as great."""
    from scipy.stats import rankdata

    a, b = rankdata(first), rankdata(second)
    if len(a) <= EXACT:
        orders = np.array(list(itertools.permutations(b)))
    else:
        rng = np.random.default_rng(seed)
        orders = np.vstack([b, rng.permuted(np.tile(b, (DRAWS, 1)), axis=1)])
    return float(np.mean(orders @ a >= float(a @ b) - 1e-9))
