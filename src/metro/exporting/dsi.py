"""Identified quantities as a D-SI document: real quantities with SI units and coverage intervals.

D-SI 2.1.0 of the PTB (doi:10.5281/zenodo.3366901), which digital calibration certificates (DCC) embed. The
certificate itself, with its laboratory, items and signatures, is for an accredited laboratory to issue.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from xml.etree import ElementTree as Xml

NAMESPACE = "https://ptb.de/si"
COVERAGE = 1.959963984540054  # half of a 95 % interval in standard deviations
# Unit of the outputs → the same in D-SI, which writes units as the LaTeX package siunitx does.
UNITS = {
    "1": r"\one",
    "%": r"\percent",
    "Hz": r"\hertz",
    "N": r"\newton",
    "N m": r"\newton\metre",
    "N m/rad": r"\newton\metre\radian\tothe{-1}",
    "N*m/rad": r"\newton\metre\radian\tothe{-1}",
    "N m s/rad": r"\newton\metre\second\radian\tothe{-1}",
    "1/s": r"\second\tothe{-1}",
    "N/m": r"\newton\metre\tothe{-1}",
    "N/mm": r"\newton\milli\metre\tothe{-1}",
    "N/mm2": r"\newton\milli\metre\tothe{-2}",
    "N/um": r"\newton\micro\metre\tothe{-1}",
    "deg": r"\degree",
    "kg": r"\kilogram",
    "kg m2": r"\kilogram\metre\tothe{2}",
    "m": r"\metre",
    "mdeg": r"\milli\degree",
    "mm": r"\milli\metre",
    "mm2": r"\milli\metre\tothe{2}",
    "ms": r"\milli\second",
    "rad": r"\radian",
    "rpm": r"\minute\tothe{-1}",
    "s": r"\second",
    "s/s": r"\one",
    "um": r"\micro\metre",
    "um/N": r"\micro\metre\newton\tothe{-1}",
    "um/min": r"\micro\metre\minute\tothe{-1}",
    "urad": r"\micro\radian",
}

Quantity = tuple[str, float | None, float | None, float | None, str]


def dsi_document(batch: str, quantities: Iterable[Quantity]) -> tuple[str, list[str]]:
    """Return a D-SI list of the quantities of a batch as XML, and the names of those that it leaves out.

    Parameters
    ----------
    quantities : name, value, ends of the 95 % interval, unit. A number without a unit is a count or an index
        and no quantity. One whose unit D-SI has no name for is left out, and named.
    """
    Xml.register_namespace("si", NAMESPACE)
    root = Xml.Element(_tag("realList"))
    _text(root, "label", f"identified quantities of {batch}")
    left_out = []
    for name, value, low, high, unit in quantities:
        if not unit or value is None:
            continue
        if unit not in UNITS:
            left_out.append(name)
            continue
        real = Xml.SubElement(root, _tag("real"))
        _text(real, "label", name)
        _text(real, "value", _number(value))
        _text(real, "unit", UNITS[unit])
        if low is not None and high is not None:
            interval = Xml.SubElement(real, _tag("coverageInterval"))
            _text(interval, "standardUnc", _number((high - low) / (2.0 * COVERAGE)))
            _text(interval, "intervalMin", _number(low))
            _text(interval, "intervalMax", _number(high))
            _text(interval, "coverageProbability", "0.95")
    Xml.indent(root)
    return Xml.tostring(root, encoding="unicode", xml_declaration=True) + "\n", left_out


def _tag(name: str) -> str:
    return f"{{{NAMESPACE}}}{name}"


def _text(parent: Xml.Element, name: str, text: str) -> None:
    Xml.SubElement(parent, _tag(name)).text = text


def _number(value: float) -> str:
    """Write a number as D-SI has it: a decimal, perhaps with an exponent; never infinite or undefined."""
    if not math.isfinite(value):
        raise ValueError(f"{value} is no number of D-SI")
    return repr(float(value))
