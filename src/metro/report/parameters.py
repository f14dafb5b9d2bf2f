"""The parameters of an effect in words: named without unit, axis by axis, none where not identified."""

from __future__ import annotations

from typing import Any

from metro.report.numbers import quantity, words
from metro.units import JSON, printed_name

AXES = "xyz"
NOT_IDENTIFIED = "not determined"  # an interval that holds whatever the parameter may be


def effect_words(effect: JSON) -> str:
    """Name an effect with its parameters: tool runout (radius 9.80 ± 0.30 µm, angle 112.0 ± 3.0°)."""
    name = str(effect["effect"])
    parameters = ", ".join(parameter_words(effect))
    return f"{words(name)} ({parameters})" if parameters else words(name)


def of_joint(name: str, joint: Any) -> str:
    """Name a cause, and the joint where it is of one: gear ripple of joint 4."""
    return words(name) + (f" of joint {joint}" if joint not in (None, "all") else "")


def parameter_words(effect: JSON) -> list[str]:
    """Return each parameter of an effect with its value and interval: radius 9.80 ± 0.30 µm.

    Parameters
    ----------
    effect : ``parameters`` by name, and ``per``, what each entry of a list is of.
    """
    return [
        "all joints"
        if (name, entry) == ("joint", "all")
        else f"{parameter_name(name, entry)} {parameter_value(effect, entry)}".strip()
        for name, entry in (effect.get("parameters") or {}).items()
    ]


def parameter_name(name: str, entry: Any) -> str:
    """Name of a parameter without the unit that its key ends in: radius_um → radius."""
    if isinstance(entry, list) and entry:
        return parameter_name(name, entry[0])
    if not isinstance(entry, dict):
        return words(name)
    return printed_name(name, str(entry.get("unit") or ""))


def parameter_value(effect: JSON, entry: Any) -> str:
    """Return a value of an effect with its interval and unit; of a list, that of each axis or item."""
    if not isinstance(entry, list):
        return quantity(entry) if _identified(entry) else NOT_IDENTIFIED
    identified = [_identified(item) for item in entry]
    if not any(identified):
        return NOT_IDENTIFIED
    of_axes = "axis" in (effect.get("per") or ()) and len(entry) == len(AXES)
    marks = [f"{axis} " for axis in AXES] if of_axes else [""] * len(entry)
    last = max(i for i, one in enumerate(identified) if one)
    return ", ".join(
        mark + (quantity(item, with_unit=i == last) if one else NOT_IDENTIFIED)
        for i, (mark, item, one) in enumerate(zip(marks, entry, identified, strict=True))
    )


def _identified(entry: Any) -> bool:
    return not isinstance(entry, dict) or entry.get("told", True)
