"""Parameters of the terms: their units follow from what a term acts in and what it is a function of."""

from __future__ import annotations

from metro.effects.effect import EffectParameter
from metro.observables.force.shapes import CIRCUMSTANCES, Shape

DEGREE = {"linear": 1, "square": 2}  # of the forms that have the unit of the circumstance
LEAST, MOST = 1e-3, 50.0  # of a length, relative to the range of its circumstance


def unit_of(quantity: str, factors: tuple[tuple[str, str], ...]) -> str:
    """Return the unit of a size, so that size × g₁ × g₂ has that of the quantity.

    ``factors``: form and circumstance of each function.
    """
    below = ""
    for form, variable in factors:
        degree, unit = DEGREE.get(form, 0), CIRCUMSTANCES[variable].unit
        if degree and unit != "1":
            below += f"/{unit}" + (str(degree) if degree > 1 else "")
    return quantity + below


def size(name: str, unit: str, typical: float, most: float, least: float | None = None) -> EffectParameter:
    """Return a size: zero changes nothing. ``typical`` where it is worth speaking of."""
    lower = -most if least is None else least
    return EffectParameter(name, unit, lower, most, typical, starts=(typical,))


def length(variable: str, start: float, span: float) -> EffectParameter:
    """Return the length inside a function of a circumstance, from a start; ``span``: range of it."""
    unit = CIRCUMSTANCES[variable].unit
    return EffectParameter(
        f"length_{unit}", unit, LEAST * span, MOST * span, 0.1 * start, starts=(start,), neutral=start
    )


def symbol(shape_form: str, variable: str, reference: float, length_name: str | float) -> str:
    """Return a function in symbols."""
    known = CIRCUMSTANCES[variable]
    x, unit = known.symbol, "" if known.unit == "1" else f" {known.unit}"
    at = f"{reference:g}{unit}"
    end = length_name if isinstance(length_name, str) else f"{length_name:g}{unit}"
    return {
        "linear": f"({x} − {at})",
        "square": f"({x} − {at})²",
        "logarithm": f"ln({x} / {at})",
        "inverse": f"({at} / {x})",
        "saturating": f"(1 − exp(−{x} / {end}))",
        "decay": f"exp(−{x} / {end})",
        "step": f"[{x} > {end}]",
        "sign": f"sign({x})",
    }[shape_form]


def checked(quantity: str, unit: str, shapes: tuple[Shape, ...]) -> bool:
    """Whether a size in ``unit`` times the functions has the unit of a quantity."""
    return unit == unit_of(quantity, tuple((shape.form, shape.variable) for shape in shapes))
