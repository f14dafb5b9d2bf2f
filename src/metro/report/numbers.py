"""How numbers are printed: rounded to their uncertainty, by one rule, as strings."""

from __future__ import annotations

import math
from typing import Any

from metro.units import SUPERSCRIPTS, printed

SKEW = 0.25


def number(value: float | None, digits: int = 3) -> str:
    """Write a number of unknown uncertainty to ``digits`` significant digits; an unknown number is –."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    exponent = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    if -4 <= exponent < 6:
        return _minus(f"{value:.{max(0, digits - 1 - exponent)}f}")
    return f"{_minus(f'{value / 10.0**exponent:.{digits - 1}f}')}·10{str(exponent).translate(SUPERSCRIPTS)}"


def with_interval(value: float | None, ci95: list[float | None] | None) -> str:
    """Write a value and its 95 % interval, both rounded to two digits of the interval's half width.

    A symmetric interval reads ``9.80 ± 0.30``, a skewed one ``9.80 (9.70 … 10.40)``; large and small numbers
    share a power of ten. Without an interval there is only the value, to three digits.
    """
    known = [x for x in ci95 or () if x is not None and math.isfinite(x)]
    if value is None or not math.isfinite(value) or len(known) != 2 or known[1] <= known[0]:
        return number(value)
    low, high = known
    half = (high - low) / 2
    power = _power(max(abs(value), half))
    place = 1 - math.floor(math.log10(float(f"{half / 10.0**power:.1e}")))
    v, lo, hi, h = (_fixed(x / 10.0**power, place) for x in (value, low, high, half))
    text = f"{v} ± {h}" if abs(value - (low + high) / 2) < SKEW * half else f"{v} ({lo} … {hi})"
    return text if power == 0 else f"({text})·10{str(power).translate(SUPERSCRIPTS)}"


def quantity(entry: Any, with_unit: bool = True) -> str:
    """Write a quantity of ``identified.json`` or ``verdict.json``: value ± half its 95 % interval, unit.

    A list of them (per axis, per tooth) is written item by item, with the unit last. A value that is no
    quantity (``joint: 3``) is written unchanged.
    """
    if isinstance(entry, list) and entry and all(isinstance(item, dict) for item in entry):
        first = [quantity(item, with_unit=False) for item in entry[:-1]]
        return ", ".join([*first, quantity(entry[-1], with_unit)])
    if not isinstance(entry, dict):
        return str(entry)
    value, ci95 = entry.get("value"), entry.get("ci95")
    if isinstance(value, list):
        intervals = ci95 if isinstance(ci95, list) and len(ci95) == len(value) else [None] * len(value)
        text = ", ".join(
            with_interval(v, i if isinstance(i, list) else None)
            for v, i in zip(value, intervals, strict=True)
        )
    else:
        text = value if isinstance(value, str) else with_interval(value, ci95)
    shown = printed(entry.get("unit"))
    return f"{text}{'' if shown == '°' else ' '}{shown}" if with_unit and shown else text


def percent(share: float | None) -> str:
    """Write a share as a percentage, to two digits."""
    return "–" if share is None or not math.isfinite(share) else f"{number(100 * share, 2)} %"


def probability(p: float | None) -> str:
    """Write a probability or p-value; close to 0 and to 1 only the bound is written."""
    if p is None or not math.isfinite(p):
        return "–"
    return "< 0.001" if p < 0.001 else "> 0.999" if p > 0.999 else f"{p:.3f}"


def words(name: str) -> str:
    """Return an identifier (tool_runout) as words (tool runout)."""
    return name.replace("_", " ")


def listing(items: list[str]) -> str:
    """Join items as in a sentence: a; a and b; a, b and c."""
    return " and ".join(filter(None, [", ".join(items[:-1]), *items[-1:]]))


def _power(size: float) -> int:
    """Power of ten to factor out of large and of small numbers."""
    exponent = math.floor(math.log10(size))
    return 0 if -4 <= exponent < 6 else exponent


def _fixed(value: float, place: int) -> str:
    """Round to ``place`` decimals; to tens, hundreds, … if it is negative."""
    return _minus(f"{round(value, place):.{max(0, place)}f}")


def _minus(text: str) -> str:
    """Set a true minus sign, and no sign on a zero."""
    if float(text) == 0:
        return text.lstrip("-")
    return text.replace("-", "−")
