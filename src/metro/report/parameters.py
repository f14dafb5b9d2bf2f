"""The parameters of an effect in words: named without unit, axis by axis, none where nothing is told."""

from __future__ import annotations

from typing import Any

from metro.report.numbers import quantity, words
from metro.units import JSON, printed_name

PER_AXIS = ("dynamometer_resonance", "charge_drift", "charge_leak")  # their lists are those of x, y and z
NOT_TOLD = "not told"  # an interval that holds whatever the parameter may be


def effect_words(effect: JSON) -> str:
    """Name an effect with its parameters: tool runout (radius 9.80 ± 0.30 µm, angle 112.0 ± 3.0°)."""
    name = str(effect["effect"])
    told = ", ".join(parameter_words(name, effect.get("parameters") or {}))
    return f"{words(name)} ({told})" if told else words(name)


def parameter_words(effect: str, parameters: JSON) -> list[str]:
    """Return each parameter with its value and interval: radius 9.80 ± 0.30 µm."""
    return [
        "all joints"
        if (name, entry) == ("joint", "all")
        else f"{parameter_name(name, entry)} {parameter_value(effect, entry)}".strip()
        for name, entry in parameters.items()
    ]


def parameter_name(name: str, entry: Any) -> str:
    """Name of a parameter without the unit that its key ends in: radius_um → radius."""
    if isinstance(entry, list) and entry:
        return parameter_name(name, entry[0])
    if not isinstance(entry, dict):
        return words(name)
    return printed_name(name, str(entry.get("unit") or ""))


def parameter_value(effect: str, entry: Any) -> str:
    """Return a value with its interval and unit; of a list, that of each axis or item."""
    if not isinstance(entry, list):
        return quantity(entry) if _told(entry) else NOT_TOLD
    told = [_told(item) for item in entry]
    if not any(told):
        return NOT_TOLD
    marks = [f"{axis} " for axis in "xyz"] if effect in PER_AXIS and len(entry) == 3 else [""] * len(entry)
    last = max(i for i, one in enumerate(told) if one)
    return ", ".join(
        mark + (quantity(item, with_unit=i == last) if one else NOT_TOLD)
        for i, (mark, item, one) in enumerate(zip(marks, entry, told, strict=True))
    )


def _told(entry: Any) -> bool:
    return not isinstance(entry, dict) or entry.get("told", True)
