"""An effect's parameters as found against the true ones, up to what cannot be observed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from metro.units import JSON

# Angles that are known up to a period: that of the teeth, a whole turn or half of one.
ANGLES = {
    ("tool_runout", "angle_deg"): "pitch",
    ("orbit_stiffness", "phase_deg"): "turn",
    ("mode_coupling", "angle_deg"): "half",
    ("gear_ripple", "phase_deg"): "turn",
}
# Effects whose parameters are the entries of one vector: an entry's error is relative to the largest of them.
VECTORS = ("spindle_tilt", "fixture_bow")


@dataclass(frozen=True)
class Estimate:
    """One true value and what was found for it.

    ``error`` is relative (in a list or a vector: to its largest value), of an angle that has a period in
    degrees; ``covered``: whether the 95 % interval holds the truth, as well as that can be said in these
    parameters; None where none is stated.
    """

    effect: str
    parameter: str
    error: float
    covered: bool | None


def estimates(
    effect: str,
    truth: Mapping[str, Any],
    estimated: JSON,
    teeth: int,
    doubt: Mapping[str, float] | float = 0.0,
) -> list[Estimate]:
    """Compare the parameters that truth and finding both have.

    Which tooth is the first one cannot be observed: the angle of runout is compared modulo the pitch, and a
    list that has an entry per tooth in the cyclic order that fits best. Words (an axis) and the number of a
    joint are not compared.

    Parameters
    ----------
    truth, estimated : as in the contract's table of effects and in verdict.json: a value or a list of values
        by name.
    doubt : error of the truth in these parameters, where what was built has another form: by name in the unit
        of each, or relative (in a list or a vector: to its largest value).
    """
    largest = max(abs(value) for value in truth.values()) if effect in VECTORS else None
    return [
        one
        for name, value in truth.items()
        if name in estimated and name != "joint" and not isinstance(value, str)
        if len(_list(value)) == len(_list(estimated[name])) and all(map(_numeric, _list(estimated[name])))
        for one in _compared(
            effect,
            name,
            np.array(_list(value), dtype=float),
            _list(estimated[name]),
            teeth=teeth,
            largest=largest,
            doubt=doubt,
        )
    ]


def _numeric(entry: Any) -> bool:
    return isinstance(entry, dict) and isinstance(entry["value"], int | float)


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


def _compared(
    effect: str,
    name: str,
    true: np.ndarray,
    estimated: list[JSON],
    *,
    teeth: int,
    largest: float | None,
    doubt: Mapping[str, float] | float,
) -> Iterator[Estimate]:
    value = np.array([entry["value"] for entry in estimated], dtype=float)
    period = _period(effect, name, teeth)
    if period is not None:
        true = true + period * np.round((value - true) / period)
    elif effect in ("pitch_error", "uneven_teeth"):
        turned = [np.roll(true, shift) for shift in range(len(true))]
        true = min(turned, key=lambda order: float(np.sum((order - value) ** 2)))
    scale = 1.0 if period is not None else largest or float(np.abs(true).max())
    unsure = doubt.get(name, 0.0) if isinstance(doubt, Mapping) else doubt * scale
    for right, error, entry in zip(true.tolist(), ((value - true) / scale).tolist(), estimated, strict=True):
        low, high = entry.get("ci95") or (None, None)
        covered = None if low is None or high is None else _holds(low, entry["value"], high, right, unsure)
        yield Estimate(effect, name, error, covered)


def _holds(low: float, value: float, high: float, truth: float, unsure: float) -> bool:
    """Whether an interval holds a truth that is itself known to ``unsure``: two independent errors add."""
    reach = value - low if truth < value else high - value
    return abs(truth - value) <= math.hypot(reach, unsure)


def _period(effect: str, name: str, teeth: int) -> float | None:
    """Period of an angle in degrees; None of anything else."""
    whole = ANGLES.get((effect, name))
    return {"pitch": 360.0 / teeth, "turn": 360.0, "half": 180.0, None: None}[whole]
