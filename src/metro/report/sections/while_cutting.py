"""The stiffness of an arm while it cuts, where a verdict found it to differ from that of the load tests."""

from __future__ import annotations

from metro.report.numbers import quantity, with_interval
from metro.report.results import Results
from metro.units import JSON

CAUSE = "stiffness_scale"
NORMAL = 1.96
USE = (
    "Use the stiffness by load tests for loads at rest, such as the weight of the tool or a probe. Use that "
    "while cutting for the deflection under cutting forces and for its compensation."
)


def factor_of(results: Results) -> JSON | None:
    """Return the stiffness of all joints while cutting over that of the load tests; None unless found.

    A factor of one joint alone changes the stiffness of the tip otherwise in each pose.
    """
    for cause in results.loop.get("causes") or []:
        factor = (cause.get("parameters") or {}).get("factor")
        joint = (cause.get("where") or {}).get("joint", "all")
        if (
            cause.get("cause") == CAUSE
            and joint == "all"
            and cause.get("status") != "contradiction"
            and factor
        ):
            return dict(factor)
    return None


def compared(results: Results) -> str:
    """Compare the stiffness while cutting with that of the load tests, and say what to use each for."""
    factor = factor_of(results)
    if factor is None:
        return ""
    times = quantity({**factor, "unit": None})
    return (
        f"While cutting, the arm has {times} times the stiffness of the load tests (see the verdicts). {USE}"
    )


def scaled(stiffness: float, sd: float, factor: JSON) -> str:
    """Write a stiffness by load tests as it is while cutting, with the 95 % interval of both."""
    low, high = factor["ci95"]
    value = stiffness * float(factor["value"])
    half = value * ((NORMAL * sd / stiffness) ** 2 + ((high - low) / (2.0 * factor["value"])) ** 2) ** 0.5
    return with_interval(value, [value - half, value + half])
