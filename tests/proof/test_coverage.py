"""Intervals of coefficients against the truth."""

import pandas as pd
import pytest

from metro.batch.batch import Batch
from proof.coverage import Interval, identifiable, identified, intervals, table
from proof.statistics import Demand, share
from proof.tables import tabulated


def quantity(value, half):
    return {"value": value, "ci95": [value - half, value + half], "unit": "N/mm2"}


def test_errors_and_widths_are_relative_to_the_truth():
    (one,) = intervals({"waveform": {"ktc": quantity(1010.0, 20.0)}}, {"ktc": 1000.0})
    assert (one.error, one.half) == pytest.approx((0.01, 0.02))


@pytest.mark.parametrize(
    ("value", "covers"), [(1019.0, True), (981.0, True), (1021.0, False), (979.0, False)]
)
def test_an_interval_covers_what_lies_between_its_ends(value, covers):
    (one,) = intervals({"mean": {"ktc": quantity(value, 20.0)}}, {"ktc": 1000.0})
    assert one.covers is covers


def test_a_coefficient_that_is_not_told_does_not_count():
    unknown = {"value": 3.0, "ci95": [None, None], "unit": "N/mm"}
    found = {"waveform": {"ktc": quantity(1.0, 0.1), "kfac": unknown}, "edge_length": "axial"}
    assert [one.name for one in intervals(found, {"ktc": 1.0, "kfac": 1.0})] == ["ktc"]


def test_holes_of_one_axial_feed_tell_the_whole_thrust_of_the_bottom_edges():
    # 2 mm per orbit of 100 turns of 4 teeth: 0.005 mm per tooth; the held-out hole has another.
    runs = pd.DataFrame(
        {
            "operation": ["slot", "helical", "helical"],
            "role": ["identify", "validate", "identify"],
            "spindle_rpm": [3000.0, 3000.0, 3000.0],
            "orbit_rpm": [None, 60.0, 30.0],
            "axial_depth_mm": 2.0,
        }
    )
    batch = Batch("b", {"tool": {"teeth": 4}}, {}, runs, {})
    truth = identifiable(batch, {"ktc_n_mm2": 800.0, "kfac_n_mm2": 90.0, "kfae_n_mm": 4.0})
    assert truth == pytest.approx({"ktc": 800.0, "kfae": 4.0 + 90.0 * 0.005})


def test_the_table_has_the_share_of_all_and_of_each_coefficient():
    found = [
        *(Interval("waveform", "ktc", error, 0.02) for error in (0.01, -0.03, 0.0, 0.019)),
        *(Interval("waveform", "kte", error, 0.02) for error in (0.01, 0.0)),
        Interval("mean", "ktc", 1.0, 0.1),
    ]
    rows = table(found, "waveform").rows
    assert [row[1] for row in rows] == ["83.3 %", "75.0 %", "100.0 %"]
    assert [row[-1] for row in rows] == ["no, within chance", "", ""]
    assert [row[3] for row in rows] == ["6", "4", "2"]


@pytest.mark.slow
def test_a_batch_that_hides_nothing_has_its_coefficients_near_the_truth():
    found = identified(7, "a")
    assert {one.way for one in found} == {"waveform", "mean"}
    assert all(abs(one.error) < 0.05 for one in found if one.way == "waveform")


def test_a_demand_that_is_missed_by_more_than_chance_is_told_from_one_that_few_cases_miss():
    demand = Demand(least=0.9, most=0.98)
    figures = [
        share("", [True] * hits + [False] * (n - hits), demand)
        for hits, n in ((3, 3), (9, 20), (95, 100), (0, 0))
    ]
    assert [row[-1] for row in tabulated("", figures, "").rows] == [
        "no, within chance",
        "NO",
        "yes",
        "no case",
    ]
