"""Conformity by ISO 14253-1: the tolerance zone, less a guard band of the expanded uncertainty.

A result conforms if its whole 95 % interval lies within the limits, and it does not conform if the whole
interval lies outside. In between nothing can be proven: the result is undecided. The guard band is the
distance from the value to the end of its interval, U (coverage 95 %) on the side of the limit. This is the
rule of the edition of 2013; that of 2017 asks for a conformance probability of 95 %, which is a guard band of
1.65 u, and accepts all that is accepted here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from metro.units import JSON

COVERAGE = 1.959963984540054  # half of a 95 % interval in standard deviations
CONFORMS, FAILS, UNDECIDED = "conforms", "does_not_conform", "undecided"


@dataclass(frozen=True)
class Limits:
    """Limits of a quantity, in its unit; None: there is none on that side."""

    lower: float | None = None
    upper: float | None = None

    @classmethod
    def of(cls, entry: JSON) -> Limits:
        """Return the limits that an entry of ``tolerances`` in ``batch.yaml`` states."""
        return cls(entry.get("lower"), entry.get("upper"))

    @property
    def ends(self) -> tuple[float, float]:
        """Both limits; infinite where there is none."""
        lower = -math.inf if self.lower is None else self.lower
        upper = math.inf if self.upper is None else self.upper
        return lower, upper


@dataclass(frozen=True)
class Result:
    """A measured value with its 95 % interval; None: an end that is not known."""

    value: float
    low: float | None
    high: float | None


def decision(result: Result, limits: Limits) -> str:
    """Return ``conforms``, ``does_not_conform`` or ``undecided``."""
    if result.low is None or result.high is None:
        return UNDECIDED
    lower, upper = limits.ends
    if lower <= result.low and result.high <= upper:
        return CONFORMS
    return FAILS if result.high < lower or result.low > upper else UNDECIDED


def conformance_probability(result: Result, limits: Limits) -> float | None:
    """Probability that the quantity is within its limits; None where the interval is not known.

    The error is taken as normal, with the standard uncertainty of the side of the value that each limit is
    on: an interval may reach further up than down.
    """
    if result.low is None or result.high is None:
        return None
    lower, upper = limits.ends
    return _below(result, upper) - _below(result, lower)


def _below(result: Result, limit: float) -> float:
    """Probability that the quantity is below a limit."""
    assert result.low is not None
    assert result.high is not None
    if math.isinf(limit):
        return 1.0 if limit > 0.0 else 0.0
    reach = result.high - result.value if limit > result.value else result.value - result.low
    if reach <= 0.0:
        return 1.0 if limit > result.value else 0.0
    return 0.5 * math.erfc(-(limit - result.value) * COVERAGE / (reach * math.sqrt(2.0)))
