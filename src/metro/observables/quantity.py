"""How an identified quantity is written: value, 95 % interval, unit."""

from __future__ import annotations

import math

from metro.units import JSON


def quantity(value: float, sd: float, unit: str, dof: float = math.inf) -> JSON:
    """Return ``{"value", "ci95", "unit"}``, the interval by Student's t with ``dof`` degrees of freedom.

    ``value`` and ``sd`` are in ``unit``. A value or a deviation that is not finite is unknown, and is written
    as null.
    """
    from scipy.stats import t

    half = float(t.ppf(0.975, dof)) * sd if math.isfinite(dof) else 1.959963984540054 * sd
    interval = [_number(value - half), _number(value + half)]
    return {"value": _number(value), "ci95": interval, "unit": unit}


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
