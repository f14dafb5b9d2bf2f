"""What each number that people write may be, and why, as ``schemas/ranges.json`` has it."""

from __future__ import annotations

import functools
import importlib.resources
import json
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from metro.units import (
        JSON,
    )  # which imports NumPy, and this module is imported at every call of snakemake

REFERENCE = "ranges.json#/$defs/"
# A number closer to zero has no measured digit in any unit. The fourth power of this one, and one over that,
# are numbers of double precision (1e-308 to 1e308): no product of two squares becomes zero or infinite.
SMALLEST = 1e-30
SIGNS = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
KINDS = {"integer": "an integer", "number": "a number"}
DIGITS = 7  # of a bound that is written without an exponent


@functools.cache
def schema(name: str) -> JSON:
    """Return the JSON Schema (draft 2020-12) ``name`` of this package, with the ranges that it refers to."""
    file = importlib.resources.files("metro.batch").joinpath("schemas", f"{name}.json")
    content: JSON = _with_ranges(json.loads(file.read_text(encoding="utf-8")))
    return content


def range_of(name: str) -> JSON:
    """Return the rule of a quantity as JSON Schema: type, bounds, unit, and the reason as description."""
    rule: JSON = schema("ranges")["$defs"][name]
    return rule


def _with_ranges(part: Any) -> Any:
    """Return a part of a schema in which every reference to a range is replaced by the range."""
    if isinstance(part, list):
        return [_with_ranges(inner) for inner in part]
    if not isinstance(part, dict):
        return part
    name = str(part.get("$ref", ""))
    if name.startswith(REFERENCE):
        return range_of(name.removeprefix(REFERENCE))
    return {key: _with_ranges(inner) for key, inner in part.items()}


def bounds(rule: Mapping[str, Any]) -> str:
    """Write the bounds of a number with their unit, as ``0.02 to 2000 mm``; "" where it has none."""
    unit = f" {rule['unit']}" if "unit" in rule else ""
    if "minimum" in rule and "maximum" in rule:
        return f"{_plain(rule['minimum'])} to {_plain(rule['maximum'])}{unit}"
    return " and ".join(f"{sign} {_plain(rule[key])}{unit}" for key, sign in SIGNS.items() if key in rule)


def number_in_words(rule: Mapping[str, Any]) -> str:
    """Say what number a rule asks for, as ``an integer, 1 to 120`` or ``a number > 0 and < 1``."""
    kind, limits = KINDS[rule["type"]], bounds(rule)
    return f"{kind}{',' if ' to ' in limits else ''} {limits}".rstrip()


def expected_for(rule: Mapping[str, Any], given: Any) -> str:
    """Say what a rule of numbers expects in place of ``given``; to one out of range, with the reason."""
    number = isinstance(given, int | float) and not isinstance(given, bool)
    if not number or within(rule, given) or "description" not in rule:
        return number_in_words(rule)
    words = number_in_words(rule).removeprefix(f"{KINDS[rule['type']]}, ")
    return f"{words}: {rule['description']}"


def within(rule: Mapping[str, Any], value: float) -> bool:
    """Return whether a number lies within the bounds of a rule."""
    least, most = rule.get("minimum", -math.inf), rule.get("maximum", math.inf)
    above, below = rule.get("exclusiveMinimum", -math.inf), rule.get("exclusiveMaximum", math.inf)
    return bool(least <= value <= most and above < value < below)


def too_small(value: float) -> str:
    """Say what is expected in place of a number too close to zero to compute with; "" for others."""
    return f"0, or at least {SMALLEST:g} in size" if 0 < abs(value) < SMALLEST else ""


def _plain(value: float) -> str:
    """Write a bound without an exponent where that is short, and an exponent without noughts before it."""
    number, _, power = f"{value:g}".partition("e")
    if value == int(value) and (len(str(abs(int(value)))) <= DIGITS or float(f"{value:g}") != value):
        return str(int(value))
    return f"{number}e{int(power)}" if power else number
