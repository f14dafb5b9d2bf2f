"""Rows for runs that are to be made."""

import math

import numpy as np
import pandas as pd
import pytest

from metro.batch.columns import RUNS
from metro.batch.findings import ContractError
from metro.batch.planned import in_random_order, limits_of, row_like, within
from metro.batch.runs import filled
from metro.batch.tables import read_table

MANIFEST = {"tool": {"diameter_mm": 16.0}}


@pytest.fixture
def runs():
    rows = [
        {"run": f"r{i}", "operation": "slot", "spindle_rpm": 5000.0, "feed_per_tooth_mm": feed}
        | {"axial_depth_mm": 1.5, "cut_length_mm": 100.0, "dynamometer": f"r{i}.csv", "role": "identify"}
        for i, feed in enumerate((0.05, 0.1, 0.05), start=1)
    ]
    blank = {column.name: math.nan if column.numeric else "" for column in RUNS}
    return filled(pd.DataFrame([{**blank, **row} for row in rows]), MANIFEST).set_index("run")


def test_a_row_is_like_its_run_but_for_what_is_changed_and_names_no_file(runs):
    row = row_like(runs, "r2", {"feed_per_tooth_mm": 3.0, "orbit_rpm": 3.0}, {"feed_direction_deg": 90.0})
    assert row["feed_per_tooth_mm"] == 0.3
    assert row["feed_direction_deg"] == 90.0
    assert row["spindle_rpm"] == 5000.0
    assert math.isnan(row["orbit_rpm"])
    assert "dynamometer" not in row
    assert row["condition"] not in set(runs["condition"])


def test_what_has_the_settings_of_a_condition_is_of_that_condition(runs):
    assert row_like(runs, "r1", {}, {})["condition"] == runs.loc["r1", "condition"]
    assert row_like(runs, "r2", {"feed_per_tooth_mm": 0.5}, {})["condition"] == runs.loc["r1", "condition"]


def test_every_round_cuts_each_condition_once_and_goes_on_where_the_batch_ends(runs):
    again, new = row_like(runs, "r1", {}, {}), row_like(runs, "r2", {"axial_depth_mm": 2.0}, {})
    table = in_random_order(runs, [(again, 3), (new, 2)], seed=4)
    assert table["order"].tolist() == [4, 5, 6, 7, 8]
    assert set(table["run"]).isdisjoint(runs.index)
    assert table["run"].is_unique
    assert table[table["condition"] == again["condition"]]["replicate"].tolist() == [3, 4, 5]
    assert table[table["condition"] == new["condition"]]["replicate"].tolist() == [1, 2]
    for first in (0, 2):
        assert table["condition"][first : first + 2].nunique() == 2


def test_the_order_is_drawn_by_the_seed(runs):
    wanted = [(row_like(runs, "r2", {"axial_depth_mm": 1.0 + 0.1 * i}, {}), 1) for i in range(8)]
    orders = [tuple(in_random_order(runs, wanted, seed)["axial_depth_mm"]) for seed in (0, 0, 1)]
    assert orders[0] == orders[1] != orders[2]
    assert sorted(orders[0]) == sorted(orders[2])


def test_the_table_is_one_that_the_contract_takes(runs, tmp_path):
    table = in_random_order(runs, [(row_like(runs, "r2", {"feed_per_tooth_mm": 2.0}, {}), 2)], seed=0)
    table.to_csv(tmp_path / "runs.csv", index=False)
    read, findings = read_table(tmp_path, "runs")
    assert not [finding for finding in findings if finding.severity == "error"]
    assert read.frame["feed_per_tooth_mm"].tolist() == [0.2, 0.2]


def test_limits_are_read_and_keep_settings_within(runs):
    limits = limits_of(["axial_depth_mm=0.5:2", "spindle_rpm=:6000"])
    assert limits == {"axial_depth_mm": (0.5, 2.0), "spindle_rpm": (-math.inf, 6000.0)}
    assert within(row_like(runs, "r1", {}, {}), limits)
    assert not within(row_like(runs, "r1", {"axial_depth_mm": 2.0}, {}), limits)
    assert not within(row_like(runs, "r1", {"spindle_rpm": 1.25}, {}), limits)
    assert within({"orbit_rpm": np.nan}, {"orbit_rpm": (1.0, 2.0)})


@pytest.mark.parametrize("word", ["depth=1:2", "axial_depth_mm", "axial_depth_mm=a:2", "axial_depth_mm=3:2"])
def test_a_limit_that_is_none_is_refused_with_what_was_found(word):
    with pytest.raises(ContractError, match="axial_depth_mm") as caught:
        limits_of([word])
    assert word in str(caught.value)
