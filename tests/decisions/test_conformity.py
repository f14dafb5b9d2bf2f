"""ISO 14253-1 against cases computed by hand: values, expanded uncertainties and limits on paper."""

import math

import pytest

from metro.decisions.conformity import Limits, Result, conformance_probability, decision

UPPER = Limits(upper=50.0)
BOTH = Limits(lower=9.95, upper=10.05)
# value, low end, high end, limits → decision by hand
CASES = [
    (45.0, 41.0, 49.0, UPPER, "conforms"),  # U = 4: 49 ≤ 50
    (46.0, 42.0, 50.0, UPPER, "conforms"),  # the end is on the limit, which belongs to the zone
    (47.0, 43.0, 51.0, UPPER, "undecided"),
    (53.0, 49.0, 57.0, UPPER, "undecided"),
    (55.0, 51.0, 59.0, UPPER, "does_not_conform"),
    (48.0, 40.0, 49.5, UPPER, "conforms"),  # skewed: only the side of the limit matters
    (48.0, 47.5, 56.0, UPPER, "undecided"),
    (10.03, 10.015, 10.045, BOTH, "conforms"),
    (10.04, 10.025, 10.055, BOTH, "undecided"),
    (9.93, 9.915, 9.945, BOTH, "does_not_conform"),
    (10.00, 9.90, 10.10, BOTH, "undecided"),  # U is as large as the tolerance: nothing can be proven
    (0.9, 0.6, 1.2, Limits(lower=0.5), "conforms"),
    (0.4, 0.1, 0.7, Limits(lower=0.5), "undecided"),
    (47.0, None, None, UPPER, "undecided"),  # no uncertainty is known
    (47.0, 43.0, None, UPPER, "undecided"),
]


@pytest.mark.parametrize(("value", "low", "high", "limits", "expected"), CASES)
def test_the_decision_is_the_one_made_by_hand(value, low, high, limits, expected):
    assert decision(Result(value, low, high), limits) == expected


@pytest.mark.parametrize(
    ("value", "half", "limits", "expected"),
    [
        (50.0, 4.0, UPPER, 0.5),  # on the limit
        (46.0, 4.0, UPPER, 0.975),  # the guard band is U: one tail of 2.5 %
        (50.0 - 4.0 * 1.6448536 / 1.959964, 4.0, UPPER, 0.95),  # the edition of 2017: 1.65 u
        (55.0, 4.0, UPPER, 0.00715),  # Φ(−2.45), from a table
        (10.0, 0.05, BOTH, 0.95),  # both tails
        (10.05, 0.05, BOTH, 0.49996),  # Φ(0) − Φ(−3.92)
    ],
)
def test_the_probability_is_that_of_the_table_of_the_normal_distribution(value, half, limits, expected):
    found = conformance_probability(Result(value, value - half, value + half), limits)
    assert found == pytest.approx(expected, abs=2e-5)


def test_a_skewed_interval_counts_with_the_side_of_the_limit():
    result = Result(10.0, 9.0, 14.0)
    assert conformance_probability(result, Limits(upper=14.0)) == pytest.approx(0.975, abs=1e-6)
    assert conformance_probability(result, Limits(lower=9.0)) == pytest.approx(0.975, abs=1e-6)


def test_without_an_interval_there_is_no_probability():
    assert conformance_probability(Result(1.0, None, 2.0), UPPER) is None


def test_an_exact_value_is_inside_or_outside():
    assert conformance_probability(Result(1.0, 1.0, 1.0), UPPER) == 1.0
    assert conformance_probability(Result(51.0, 51.0, 51.0), UPPER) == 0.0
    assert math.isinf(Limits().ends[0])
