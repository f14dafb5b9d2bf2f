"""The units that files are in, and the factor of each to the unit that the data contract has."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass

# Kind of quantity → spelling of a unit → factor to the first one. Capitals matter: Nm is no nm, mN no MN.
UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "min": 60.0},
    "force": {"N": 1.0, "kN": 1e3, "mN": 1e-3, "lbf": 4.4482216152605},
    "angle": {"deg": 1.0, "°": 1.0, "rad": math.degrees(1.0), "mrad": math.degrees(1e-3)},
    "slope": {
        "urad": 1.0,
        "µrad": 1.0,
        "μrad": 1.0,
        "um/m": 1.0,
        "µm/m": 1.0,
        "μm/m": 1.0,
        "arcsec": math.pi / 0.648,
        '"': math.pi / 0.648,
        "mm/m": 1e3,
        "mrad": 1e3,
        "rad": 1e6,
        "deg": math.pi / 180e-6,
    },
    "torque": {
        "Nm": 1.0,
        "N m": 1.0,
        "N*m": 1.0,
        "N·m": 1.0,
        "kNm": 1e3,
        "Nmm": 1e-3,
        "N mm": 1e-3,
        "Ncm": 1e-2,
    },
    "length": {
        "mm": 1.0,
        "m": 1e3,
        "cm": 10.0,
        "um": 1e-3,
        "µm": 1e-3,
        "μm": 1e-3,
        "nm": 1e-6,
        "inch": 25.4,
        "in": 25.4,
    },
    "frequency": {"Hz": 1.0, "kHz": 1e3},
    "acceleration": {
        "m/s2": 1.0,
        "m/s^2": 1.0,
        "m/s²": 1.0,
        "g": 9.80665,
        "cm/s2": 1e-2,
        "cm/s^2": 1e-2,
        "cm/s²": 1e-2,
        "mm/s2": 1e-3,
        "mm/s^2": 1e-3,
        "mm/s²": 1e-3,
        "in/s2": 0.0254,
        "in/s^2": 0.0254,
    },
    "velocity": {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3, "in/s": 0.0254},
    "voltage": {"V": 1.0, "mV": 1e-3},
    "current": {"A": 1.0, "mA": 1e-3},
    "charge": {"pC": 1.0, "nC": 1e3},
}
# Unit at the end of a column's name → the kind of quantity.
OF_COLUMN = {
    "s": "time",
    "n": "force",
    "deg": "angle",
    "urad": "slope",
    "nm": "torque",
    "mm": "length",
    "hz": "frequency",
    "a": "current",
}
# What a response of a structure may be: the contract's unit, and the factor to it from the first spelling.
RESPONSES = {"acceleration": ("m/s2", 1.0), "velocity": ("m/s", 1.0), "length": ("m", 1e-3)}
_SENSITIVITY = re.compile(r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*([^\s/]+)\s*/\s*(.+?)\s*")


class MeasureError(ValueError):
    """A unit or a sensitivity is none that is known, or not one of the quantity."""


@dataclass(frozen=True)
class Measure:
    """What the numbers of a column are: their kind of quantity, and the factor to its first unit.

    Attributes
    ----------
    quantity : key of :data:`UNITS`, or "" of a pure number.
    factor : to the first unit of the quantity.
    unit : as it is written.
    """

    quantity: str
    factor: float
    unit: str


def measure(unit: str, asked: str = "") -> Measure:
    """Find what a unit measures; brackets around it do not matter.

    ``asked``: the quantity that it should be of, where it may be of several: mrad of an angle and of a slope.

    Raises
    ------
    MeasureError
        Naming the units that are known.
    """
    text = stripped(unit)
    if text in ("", "1", "-"):
        return Measure("", 1.0, "")
    for quantity in sorted(UNITS, key=lambda each: each != asked):
        spellings = UNITS[quantity]
        if text in spellings:
            return Measure(quantity, spellings[text], text)
    raise MeasureError(f"found the unit {unit!r}, expected one of {', '.join(first_spellings())}")


def stripped(unit: str) -> str:
    """Return a unit without the brackets and spaces around it."""
    text = unit.strip()
    while text[:1] + text[-1:] in ("[]", "()", "{}"):
        text = text[1:-1].strip()
    return text


def first_spellings(quantities: Iterable[str] = UNITS) -> list[str]:
    """Return the units that are known, the first spelling of each size."""
    first: dict[tuple[str, float], str] = {}
    for each in quantities:
        for unit, size in UNITS[each].items():
            first.setdefault((each, size), unit)
    return list(first.values())


def by_sensitivity(read: Measure, sensitivity: str) -> Measure:
    """Return what numbers measure that a sensor of a sensitivity gives, as V with "10.2 mV/g" or "200 N/V".

    Raises
    ------
    MeasureError
        Where it is no number with two units, or neither is of the quantity that the numbers are in.
    """
    match = _SENSITIVITY.fullmatch(sensitivity)
    if match is None or not _nonzero(match[1]):
        raise MeasureError(f'found "{sensitivity}", expected a number and two units, as 10.2 mV/g or 200 N/V')
    size, above, below = float(match[1]), measure(match[2]), measure(match[3])
    if above.quantity == read.quantity:
        return Measure(below.quantity, read.factor / (size * above.factor) * below.factor, below.unit)
    if below.quantity == read.quantity:
        return Measure(above.quantity, read.factor / below.factor * size * above.factor, above.unit)
    raise MeasureError(
        f'found "{sensitivity}" for numbers in {read.unit or "no unit"}, '
        "expected the unit that the file's numbers are in above or below the stroke"
    )


def _nonzero(text: str) -> bool:
    try:
        return float(text) != 0.0
    except ValueError:
        return False


def per_force(unit: str) -> Measure:
    """Find what a unit of a response per force measures, as g/N, (m/s²)/N or mm/kN: the response, per newton.

    Raises
    ------
    MeasureError
        Where it is none.
    """
    above, _, below = unit.strip().replace(")(", ")/(").rpartition("/")
    if not above or stripped(below) not in UNITS["force"]:
        raise MeasureError(f"found the unit {unit!r}, expected a response per force, as g/N or m/N")
    response = measure(above)
    if response.quantity not in RESPONSES:
        raise MeasureError(
            f"found the unit {unit!r}, expected an acceleration, a velocity or a length per force"
        )
    return Measure(response.quantity, response.factor / UNITS["force"][stripped(below)], response.unit)
