"""Intervals and demands against published numbers and brute force."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from proof.statistics import Demand, binned, brier, median, share, wilson


def test_wilson_gives_the_published_intervals():
    # Newcombe, Stat. Med. 17 (1998) 857, table I, method 3
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert wilson(15, 148) == pytest.approx((0.0624, 0.1605), abs=5e-5)
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=5e-5)
    assert wilson(1, 29) == pytest.approx((0.0061, 0.1718), abs=5e-5)


@given(count=st.integers(1, 300), data=st.data())
def test_wilson_holds_the_share_itself_and_mirrors(count, data):
    hits = data.draw(st.integers(0, count))
    low, high = wilson(hits, count)
    assert 0.0 <= low <= hits / count <= high <= 1.0
    assert wilson(count - hits, count) == pytest.approx((1.0 - high, 1.0 - low))


def test_the_interval_of_the_median_holds_it_in_95_of_100_samples():
    rng = np.random.default_rng(3)
    drawn = [median("", rng.exponential(size=25).tolist()) for _ in range(2000)]
    covered = np.mean([one.low <= np.log(2.0) <= one.high for one in drawn])
    assert 0.94 <= covered <= 0.995


def test_few_values_say_nothing_sure_of_a_median():
    assert median("", [1.3] * 5, Demand(most=1.1)).met is False
    assert not median("", [1.3] * 5, Demand(most=1.1)).missed_for_sure
    assert median("", [1.3] * 6, Demand(most=1.1)).missed_for_sure


def test_a_demand_is_missed_by_the_value_and_for_sure_by_the_interval():
    nearly = share("", [True] * 46 + [False] * 4, Demand(0.95))
    assert nearly.met is False
    assert not nearly.missed_for_sure
    assert share("", [True] * 35 + [False] * 15, Demand(0.95)).missed_for_sure
    assert share("", [True] * 50, Demand(0.90, 0.98)).met is False
    assert share("", [], Demand(0.95)).met is None


def test_bins_hold_every_statement_once_and_brier_is_the_mean_square():
    stated = [(0.0, False), (0.05, True), (0.5, True), (0.97, True), (0.97, False), (1.0, True)]
    bins = binned(stated)
    assert sum(one.count for one in bins) == len(stated)
    nearly_sure = next(one for one in bins if one.low == 0.95)
    assert (nearly_sure.stated, nearly_sure.came_true.value) == pytest.approx((0.97, 0.5))
    assert brier(stated) == pytest.approx((0.0 + 0.95**2 + 0.5**2 + 0.03**2 + 0.97**2 + 0.0) / 6)
