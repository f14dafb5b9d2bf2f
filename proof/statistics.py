"""Figures with their intervals, and what is demanded of them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

NORMAL = 1.959963984540054  # 97.5 % quantile
BINS = (0.0, 0.05, 0.2, 0.5, 0.8, 0.9, 0.95, 0.99, 1.0)  # of stated probabilities


@dataclass(frozen=True)
class Demand:
    """Bounds that a figure must keep; None: no bound on that side."""

    least: float | None = None
    most: float | None = None

    def met(self, low: float, high: float) -> bool:
        """Whether something between ``low`` and ``high`` keeps the bounds."""
        over = self.most is None or low <= self.most
        return over and (self.least is None or high >= self.least)


@dataclass(frozen=True)
class Figure:
    """A share (of ``count`` cases) or a median, its 95 % interval, and what is demanded of it."""

    label: str
    value: float
    low: float
    high: float
    count: int
    demand: Demand | None = None
    unit: str = "%"

    @property
    def met(self) -> bool | None:
        """Whether the figure itself keeps the demand; None without a demand, or without a case."""
        return None if self.demand is None or not self.count else self.demand.met(self.value, self.value)

    @property
    def missed_for_sure(self) -> bool:
        """Whether the demand is missed by more than chance: nothing in the interval keeps it."""
        return self.demand is not None and self.count > 0 and not self.demand.met(self.low, self.high)


def share(label: str, cases: Sequence[bool], demand: Demand | None = None) -> Figure:
    """Share of the cases that are true, with its Wilson interval."""
    low, high = wilson(sum(cases), len(cases))
    return Figure(label, sum(cases) / len(cases) if cases else math.nan, low, high, len(cases), demand)


def wilson(hits: int, count: int) -> tuple[float, float]:
    """95 % interval of a binomial share (Wilson, J. Am. Stat. Assoc. 22 (1927) 209)."""
    if count == 0:
        return 0.0, 1.0
    from statsmodels.stats.proportion import proportion_confint

    low, high = proportion_confint(hits, count, method="wilson")
    # at 0 and 1 an end is the share itself, which rounding must not undo
    return min(float(low), hits / count), max(float(high), hits / count)


def median(label: str, values: Sequence[float], demand: Demand | None = None, unit: str = "") -> Figure:
    """Median, with the distribution-free 95 % interval between two order statistics; six values give one."""
    if not values:
        return Figure(label, math.nan, math.nan, math.nan, 0, demand, unit)
    from scipy.stats import quantile_test

    low, high = quantile_test(values, q=0, p=0.5).confidence_interval(0.95)
    low, high = -math.inf if math.isnan(low) else float(low), math.inf if math.isnan(high) else float(high)
    return Figure(label, float(np.median(values)), low, high, len(values), demand, unit)


@dataclass(frozen=True)
class Bin:
    """Stated probabilities from ``low`` to ``high``: how many, their mean, and how often they came true."""

    low: float
    high: float
    count: int
    stated: float
    came_true: Figure


def binned(stated: Sequence[tuple[float, bool]]) -> list[Bin]:
    """Put stated probabilities into bins, to be compared with what came true; empty bins are left out."""
    bins = []
    for low, high in itertools.pairwise(BINS):
        inside = [(p, right) for p, right in stated if low <= p < high or p == high == 1.0]
        if inside:
            mean = float(np.mean([p for p, _ in inside]))
            bins.append(Bin(low, high, len(inside), mean, share("", [right for _, right in inside])))
    return bins


def brier(stated: Sequence[tuple[float, bool]]) -> float:
    """Mean squared distance of stated probabilities from what came true."""
    return (
        float(np.mean([(probability - right) ** 2 for probability, right in stated])) if stated else math.nan
    )


def calibration_error(stated: Sequence[tuple[float, bool]]) -> float:
    """Return the expected calibration error: the mean distance of stated from came true, over the bins.

    Naeini, Cooper and Hauskrecht, AAAI 2015, 2901. Few cases have a distance by chance.
    """
    bins = binned(stated)
    apart = sum(one.count * abs(one.stated - one.came_true.value) for one in bins)
    return apart / len(stated) if stated else math.nan


def uniform(p_values: Sequence[float]) -> tuple[float, float]:
    """Kolmogorov-Smirnov distance of p-values from the uniform distribution, and its own p-value."""
    from scipy.stats import kstest

    found = kstest(p_values, "uniform")
    return float(found.statistic), float(found.pvalue)
