"""Runs that are cut after those of a batch: by the same tool in the same metal, as its truth has it."""

import csv

import numpy as np
import pandas as pd
import pytest

from virtual_cell.recipes.force import FEW, cut_more, make

SEED = 7
SETTINGS = ("operation", "direction", "spindle_rpm", "feed_per_tooth_mm", "axial_depth_mm", "radial_depth_mm")


def table(folder):
    with (folder / "runs.csv").open() as stream:
        return list(csv.DictReader(stream))


def planned(row, name, **changes):
    like = {key: row[key] if key in SETTINGS[:2] else float(row[key]) for key in SETTINGS}
    like |= {"cut_length_mm": float(row["cut_length_mm"]), "feed_direction_deg": 0.0}
    return like | {"run": name, "role": "identify", "condition": name, "replicate": 1, **changes}


def size(folder, row):
    """Rms of the force in full cut, N."""
    signal = pd.read_parquet(folder / row["dynamometer"])
    late = signal[signal["t_s"] > signal["t_s"].max() - 0.3]
    return float(np.sqrt((late[["fx_n", "fy_n", "fz_n"]] ** 2).sum(axis=1).mean()))


@pytest.fixture(scope="module")
def longer(tmp_path_factory):
    """A batch that hides wear, and the rows of its run table after three more runs."""
    folder = tmp_path_factory.mktemp("cell") / "few-7"
    truth = make(folder, {"tool_wear": {"edge_growth_per_m": 0.0}}, SEED, FEW)
    first = table(folder)[0]
    rows = [
        planned(first, "again"),
        planned(first, "deeper", axial_depth_mm=2.0 * float(first["axial_depth_mm"])),
        planned(first, "long", cut_length_mm=360.0),
    ]
    cut_more(folder, rows, truth["effects"], SEED, FEW)
    return folder, table(folder), rows


def test_they_come_after_the_runs_that_there_are_which_stay_as_they_are(longer):
    folder, rows, more = longer
    assert [row["run"] for row in rows[-3:]] == ["again", "deeper", "long"]
    assert [int(row["order"]) for row in rows] == list(range(1, len(rows) + 1))
    assert [row["run"] for row in rows[:-3]] == [f"r{i:02d}" for i in range(1, len(rows) - 2)]
    assert all((folder / row["dynamometer"]).is_file() for row in rows)
    assert len({row["dynamometer"] for row in rows}) == len(rows)
    assert len(more) == 3


def test_the_same_settings_give_the_same_force_and_twice_the_depth_about_twice(longer):
    folder, rows, _ = longer
    by_name = {row["run"]: size(folder, row) for row in rows}
    first = next(row["run"] for row in rows if int(row["order"]) == 1)
    assert by_name["again"] == pytest.approx(by_name[first], rel=0.05)
    assert by_name["deeper"] / by_name["again"] == pytest.approx(2.0, rel=0.25)


def test_a_run_three_times_as_long_is_recorded_three_times_as_long_in_full_cut(longer):
    folder, rows, _ = longer
    seconds = {row["run"]: pd.read_parquet(folder / row["dynamometer"])["t_s"].max() for row in rows}
    assert seconds["long"] - seconds["again"] == pytest.approx(0.8, abs=0.01)


def test_wear_goes_on_from_the_metres_that_were_cut(tmp_path):
    sizes = {}
    for growth in (0.0, 3.0):
        folder = tmp_path / f"few-{growth:g}"
        truth = make(folder, {"tool_wear": {"edge_growth_per_m": growth}}, SEED, FEW)
        first = table(folder)[0]
        cut_more(folder, [planned(first, "again")], truth["effects"], SEED, FEW)
        rows = table(folder)
        sizes[growth] = size(folder, rows[-1]) / size(folder, next(r for r in rows if r["order"] == "1"))
    assert sizes[0.0] == pytest.approx(1.0, abs=0.05)
    assert sizes[3.0] > 1.2
