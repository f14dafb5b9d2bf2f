"""Identified quantities as D-SI: order of elements, formats of numbers, units, and the same numbers back."""

import re
from xml.etree import ElementTree

import pytest

from metro.exporting.dsi import UNITS, dsi_document

SI = "{https://ptb.de/si}"
# As the schema of D-SI 2.1.0 has them: decimals with an exponent, and units of siunitx.
DECIMAL = re.compile(r"[-+]?((\d*\.\d+)|(\d+\.\d*)|(\d+\.?))([Ee][-+]?\d+)?")
PREFIXES = {"milli", "micro", "kilo"}
NAMES = {
    *("one", "percent", "hertz", "newton", "metre", "radian", "degree", "kilogram", "second", "minute"),
    *PREFIXES,
}
QUANTITIES = [
    ("force.waveform.ktc", 845.8, 804.3, 887.3, "N/mm2"),
    ("modes[0].stiffness", 7.1e6, None, None, "N/m"),
    ("small", -1.25e-17, -2e-17, 0.0, "m"),
    ("count", 3.0, None, None, ""),
    ("unknown", None, None, None, "N"),
    ("strange", 1.0, 0.5, 1.5, "furlong"),
]


@pytest.fixture(scope="module")
def document():
    text, left_out = dsi_document("a-batch", QUANTITIES)
    assert left_out == ["strange"]
    return ElementTree.fromstring(text)


def test_it_is_a_list_of_real_quantities_and_counts_are_none(document):
    assert document.tag == f"{SI}realList"
    names = [real.findtext(f"{SI}label") for real in document.iter(f"{SI}real")]
    assert names == ["force.waveform.ktc", "modes[0].stiffness", "small"]


def test_elements_stand_in_the_order_of_the_schema(document):
    first, second, _ = document.iter(f"{SI}real")
    plain = [f"{SI}{name}" for name in ("label", "value", "unit")]
    assert [child.tag for child in first] == [*plain, f"{SI}coverageInterval"]
    names = ("standardUnc", "intervalMin", "intervalMax", "coverageProbability")
    assert [child.tag for child in first[3]] == [f"{SI}{name}" for name in names]
    assert [child.tag for child in second] == plain


def test_numbers_are_the_same_and_in_the_format_of_the_schema(document):
    first, _, small = document.iter(f"{SI}real")
    assert float(first.findtext(f"{SI}value")) == 845.8
    interval = first.find(f"{SI}coverageInterval")
    assert float(interval.findtext(f"{SI}standardUnc")) == pytest.approx((887.3 - 804.3) / 2 / 1.96, rel=1e-4)
    assert interval.findtext(f"{SI}coverageProbability") == "0.95"
    assert float(small.findtext(f"{SI}value")) == -1.25e-17
    numbers = [
        e.text for e in document.iter() if e.tag.removeprefix(SI) not in {"label", "unit"} and not len(e)
    ]
    assert all(DECIMAL.fullmatch(number) for number in numbers)


@pytest.mark.parametrize("unit", UNITS)
def test_a_unit_is_made_of_names_of_the_si_and_exponents(unit):
    text = UNITS[unit]
    assert not re.search(r"\\per(?!cent)", text)  # deprecated
    parts = re.findall(r"\\([a-z]+)(?:\{(-?\d)\})?", text)
    assert "".join(f"\\{name}" + (f"{{{power}}}" if power else "") for name, power in parts) == text
    assert {name for name, power in parts if not power} <= NAMES
    assert all(power for name, power in parts if name == "tothe")


@pytest.mark.parametrize(
    ("unit", "expected"),
    [
        ("N/mm2", r"\newton\milli\metre\tothe{-2}"),
        ("N m/rad", r"\newton\metre\radian\tothe{-1}"),
        ("rpm", r"\minute\tothe{-1}"),
        ("um/N", r"\micro\metre\newton\tothe{-1}"),
    ],
)
def test_derived_units_are_written_out(unit, expected):
    assert UNITS[unit] == expected


def test_a_number_that_is_none_is_refused():
    with pytest.raises(ValueError, match="no number of D-SI"):
        dsi_document("b", [("x", float("nan"), None, None, "N")])
