"""A shift: what wears and warms up from batch to batch, and what the files of a batch say of it."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml

from virtual_cell.recipes import shift
from virtual_cell.recipes.shift import CASES, Day


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return the folder of two batches of one face and few slots each, and their truth."""
    folder = tmp_path_factory.mktemp("shift")
    plans = shift._plans
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shift, "CASES", (replace(CASES[0], replicates=1),))
        patch.setattr(
            shift, "_plans", lambda cell: [replace(plan, replicates=1) for plan in plans(cell)[-2:]]
        )
        return folder, shift.make(folder, 2, 3)


def test_growth_falls_from_that_of_the_cold_machine_to_that_of_the_warm_one():
    day = Day(0.003, (60.0, 4.0), 120.0)
    assert day.growing(0.0) == pytest.approx(60.0)
    assert day.growing(120.0) == pytest.approx(4.0 + 56.0 / np.e)
    assert day.growing(1e5) == pytest.approx(4.0)


def test_a_batch_begins_with_the_edge_as_the_one_before_left_it(made):
    folder, truth = made
    first, second = truth["batches"].values()
    cut = pd.read_csv(folder / "b-1/runs.csv")["cut_length_mm"].sum() / 1e3
    assert first["metres_before"] == 0.0
    assert second["metres_before"] == pytest.approx(cut)
    slots = 0.2  # m, in either batch
    wear = truth["day"]["wear"]
    for name in ("kte", "kre", "kae"):
        grown = second["coefficients"][name] / first["coefficients"][name]
        assert grown == pytest.approx((1.0 + wear * (cut + 0.5 * slots)) / (1.0 + wear * 0.5 * slots))
    for name in ("ktc", "krc", "kac"):
        assert second["coefficients"][name] == first["coefficients"][name]


def test_the_manifest_declares_no_coefficients_and_the_time_is_that_of_the_truth(made):
    folder, truth = made
    for name, batch in truth["batches"].items():
        manifest = yaml.safe_load((folder / name / "batch.yaml").read_text())
        assert "coefficients" not in manifest
        assert manifest["cell"] == "shift-mill"
        started = pd.to_datetime(pd.read_csv(folder / name / "runs.csv")["started_at"].iloc[0])
        assert (started - shift.START).total_seconds() == pytest.approx(60.0 * batch["minutes"])


def test_every_run_has_a_record_or_a_scan_and_the_order_is_that_of_cutting(made):
    folder, _ = made
    runs = pd.read_csv(folder / "b-2/runs.csv")
    assert runs["order"].tolist() == [1, 2, 3]
    assert runs["operation"].tolist()[-1] == "face"
    for row in runs.itertuples():
        files = [file for file in (row.dynamometer, row.scan) if isinstance(file, str)]
        assert [(folder / "b-2" / file).is_file() for file in files] == [True]
