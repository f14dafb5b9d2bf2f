"""A value that several files give, each with its error, where it may differ between them by more than that.

theta_i = theta + b_i + e_i, with the error e_i of variance v_i known and the variance tau² of b_i not. tau²
is what makes the weighted sum of squares of the theta_i about their mean equal to the median of its chi²
distribution: it is as often too large as too small (the median-unbiased form of Paule and Mandel, J. Res. NBS
87 (1982) 377; Viechtbauer, Res. Synth. Methods 12 (2021) 429). With two files that sum is made equal to its
mean, since the median of one degree of freedom finds a difference in half of all pairs that have none.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from metro.units import Array

_ROUNDS = 80  # bisections; tau² is then known to rounding


@dataclass(frozen=True)
class Common:
    """What the files have in common.

    Attributes
    ----------
    value : weighted mean.
    sd : half of its 95 % interval over 1.96.
    scatter : tau, standard deviation between the files beyond their errors; 0 where these explain it.
    files : how many there are.
    chance : probability that their errors alone make them differ so much (chi² about their mean).
    """

    value: float
    sd: float
    scatter: float
    files: int
    chance: float


def common_value(values: Array, sd: Array) -> Common:
    """Mean of ``values`` (k,) with errors ``sd`` (k,), k > 0, and its interval.

    The variance of the mean is that of the errors plus what tau adds. Only the latter was estimated from
    k - 1 degrees of freedom: Satterthwaite's number for the sum, (k - 1) / share², gives Student's quantile.
    """
    from scipy import stats

    errors = sd**2
    scatter = _between(values, errors)
    weight = 1.0 / (errors + scatter)
    value, variance = float(weight @ values / weight.sum()), 1.0 / float(weight.sum())
    share = 1.0 - 1.0 / float(np.sum(1.0 / errors)) / variance
    widening = 1.0
    if scatter > 0.0:
        freedom = (len(values) - 1) / share**2
        widening = float(stats.t.ppf(0.975, freedom) / stats.norm.ppf(0.975))
    chance = float(stats.chi2.sf(_spread(values, errors), len(values) - 1)) if len(values) > 1 else 1.0
    return Common(value, math.sqrt(variance) * widening, math.sqrt(scatter), len(values), chance)


def _between(values: Array, errors: Array) -> float:
    """Variance between the files, 0 where their errors explain the scatter."""
    from scipy import stats

    freedom = len(values) - 1
    if freedom == 0:
        return 0.0
    expected = float(stats.chi2.median(freedom)) if freedom > 1 else 1.0

    def excess(between: float) -> float:
        return _spread(values, errors + between) - expected

    if excess(0.0) <= 0.0:
        return 0.0
    low, high = 0.0, float(np.max(errors)) + float(np.var(values)) + 1e-300
    while excess(high) > 0.0:
        high *= 4.0
    for _ in range(_ROUNDS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) > 0.0 else (low, middle)
    return high


def _spread(values: Array, variance: Array) -> float:
    """Weighted sum of squares of values about their mean."""
    weight = 1.0 / variance
    return float(weight @ (values - weight @ values / weight.sum()) ** 2)
