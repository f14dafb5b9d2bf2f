"""Numbers as they are printed."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from metro.observables.stability import modal_notes
from metro.report.numbers import listing, number, percent, probability, quantity, with_interval
from metro.report.parameters import parameter_name


@pytest.mark.parametrize(
    ("value", "ci95", "text"),
    [
        (9.8342, [9.5241, 10.1443], "9.83 ± 0.31"),
        (958.861, [952.8, 964.8], "958.9 ± 6.0"),
        (9.8, [9.7, 10.4], "9.80 (9.70 … 10.40)"),
        (7.25548e6, [7.2155e6, 7.2955e6], "(7.255 ± 0.040)·10⁶"),
        (-0.00012, [-0.00014, -0.0001], "−0.000120 ± 0.000020"),
        (958.861, [848.0, 1069.0], "960 ± 110"),
        (2.4e-6, [2.2e-6, 2.6e-6], "(2.40 ± 0.20)·10⁻⁶"),
        (3.14159, None, "3.14"),
        (3.14159, [None, None], "3.14"),
        (None, None, "–"),
    ],
)
def test_a_value_is_rounded_to_two_digits_of_its_interval(value, ci95, text):
    assert with_interval(value, ci95) == text


@given(st.floats(-1e8, 1e8), st.floats(1e-7, 1e7))
def test_what_is_printed_is_the_value_within_a_tenth_of_its_uncertainty(value, half):
    text = with_interval(value, [value - half, value + half])
    if value - half == value:
        return
    power = {"": 0}.get(text[-1:], 0)
    found = re.match(r"\(?(−?[\d.]+) ± ([\d.]+)\)?(?:·10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))?$", text)
    assert found, text
    power = int((found[3] or "⁰").translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")))
    printed, width = (float(x.replace("−", "-")) * 10.0**power for x in found.group(1, 2))
    assert abs(printed - value) <= 0.1 * half + 1e-9 * abs(value)
    assert width == pytest.approx(half, rel=0.06)


def test_a_quantity_carries_its_unit_and_a_list_is_written_item_by_item():
    assert quantity({"value": 9.83, "ci95": [9.52, 10.14], "unit": "um"}) == "9.83 ± 0.31 µm"
    assert quantity({"value": 41.2, "ci95": [38.8, 43.6], "unit": "deg"}) == "41.2 ± 2.4°"
    assert (
        quantity({"value": [1.0, 2.0], "ci95": [[0.9, 1.1], [1.5, 2.5]], "unit": "N/s"})
        == "1.00 ± 0.10, 2.00 ± 0.50 N/s"
    )
    axes = [{"value": v, "ci95": [v - 10, v + 10], "unit": "Hz"} for v in (770.0, 980.0)]
    assert quantity(axes) == "770 ± 10, 980 ± 10 Hz"
    assert parameter_name("frequency_hz", axes) == "frequency"
    assert quantity({"value": "all"}) == "all"
    assert quantity(3) == "3"


def test_numbers_without_uncertainty_keep_three_digits():
    assert [number(x) for x in (0, 1.23456, 123456.0, 1.2e-7, -5.0, float("nan"))] == [
        *("0", "1.23", "123456", "1.20·10⁻⁷", "−5.00", "–"),
    ]


def test_shares_probabilities_and_lists_read_as_one_says_them():
    assert percent(0.0833) == "8.3 %"
    assert [probability(p) for p in (1e-9, 0.0312, 0.99999, None)] == ["< 0.001", "0.031", "> 0.999", "–"]
    assert [listing(x) for x in ([], ["a"], ["a", "b"], ["a", "b", "c"])] == [
        "",
        "a",
        "a and b",
        "a, b and c",
    ]


@pytest.mark.parametrize(
    ("value", "sd"), [(379.4, 90.0), (31.4738, 0.21), (5.5123, 0.6), (0.0123, 0.00043), (60.0, 5.08)]
)
def test_notes_of_the_modal_test_write_an_interval_as_the_report_does(value, sd):
    half = 1.96 * sd
    assert modal_notes._with_interval(value, sd) == with_interval(value, [value - half, value + half])
