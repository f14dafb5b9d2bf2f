"""What is said of new force records: those that the model predicts, and those that differ in a known way."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from metro.batch.findings import ContractError
from metro.loop.checks.floor import against_floor
from metro.loop.checks.left_out import scored_unseen
from metro.watch.figures import compared
from virtual_cell.recipes.slot import ALUMINIUM, PLANS

SLOT, DOWN, UP = (
    next(plan for plan in PLANS if plan.condition == name) for name in ("slot-0.11", "down-0.09", "up-0.09")
)
FORCES = ["fx_n", "fy_n", "fz_n"]


def judged(place, table, plan=SLOT, **settings):
    """Return the one judgement on a record that is dropped in as run r90."""
    place.plan("r90", plan, **settings)
    watcher = place.watcher()
    assert list(watcher.look()) == []
    place.drop("r90", table)
    (said,) = place.later(watcher)
    assert (said.file, said.run) == ("force/r90.parquet", "r90")
    return said


@pytest.mark.parametrize("plan", [SLOT, DOWN, UP], ids=lambda plan: plan.condition)
def test_a_run_of_the_same_machine_is_as_predicted(place, plan):
    said = judged(place, place.record("r90", plan), plan)
    assert said.status == "as predicted"
    assert said.headline.startswith("as predicted: measured less predicted is ")
    assert said.advice == "Go on."
    assert said.figures["all"]["times"] < 2.0
    assert set(said.figures) == {"all", "x", "y", "z"}


def test_a_force_a_fifth_too_high_is_off_in_proportion(place):
    table = place.record("r90", SLOT)
    rms = float(np.sqrt((table[FORCES].iloc[4000:] ** 2).to_numpy().mean()))
    table[FORCES] *= 1.2
    said = judged(place, table)
    assert said.status == "differs"
    assert said.headline.startswith("differs by ")
    assert said.figures["all"]["rms_n"] == pytest.approx(0.2 * rms, rel=0.05)
    assert said.causes[0] == "proportion"
    assert "a force that is 20 % larger in proportion" in said.reasons[1]
    assert "another axial depth" in said.reasons[1]
    assert said.advice.startswith("Stop and check the axial depth")


def test_a_deeper_cut_than_the_table_states_is_in_proportion_until_the_table_is_corrected(place):
    """A depth that differs moves the waveform a little, too; the shape is that of the whole force."""
    deeper = replace(SLOT, axial_depth_mm=2.3)
    place.plan("r90", SLOT)
    place.drop("r90", place.record("r90", deeper))
    watcher = place.watcher()
    (said,) = place.later(watcher)
    assert (said.status, said.causes[0]) == ("differs", "proportion")
    table = pd.read_csv(place.raw / "runs.csv")
    table.loc[table["run"] == "r90", "axial_depth_mm"] = 2.3
    table.to_csv(place.raw / "runs.csv", index=False)
    (again,) = place.later(watcher)
    assert (again.run, again.status) == ("r90", "as predicted")


def test_a_force_that_is_a_third_too_low_is_smaller(place):
    table = place.record("r90", DOWN)
    table[FORCES] *= 0.7
    said = judged(place, table, DOWN)
    assert "30 % smaller" in " ".join(said.reasons)


def test_a_tool_that_runs_out_is_told_by_its_force_once_per_revolution(place):
    said = judged(place, place.record("r90", SLOT, runout_um=10.0))
    assert (said.status, said.causes) == ("differs", ("runout",))
    assert "once per revolution" in said.reasons[1]
    assert "clamping of the tool" in said.advice


def test_worn_edges_are_told_from_a_deeper_cut(place):
    worn = replace(ALUMINIUM, kte=2 * ALUMINIUM.kte, kre=2 * ALUMINIUM.kre, kae=2 * ALUMINIUM.kae)
    said = judged(place, place.record("r90", SLOT, coefficients=worn))
    assert said.causes == ("edge",)
    larger = re.search(r"edge forces that are (\d+) % larger", said.reasons[1])
    assert int(larger[1]) == pytest.approx(100, abs=10)


def test_a_zero_that_is_off_is_a_matter_of_the_instrument(place):
    table = place.record("r90", SLOT)
    table["fy_n"] += np.where(table["t_s"] > table["t_s"].iloc[1500], 12.0, 0.0)  # after the zero was read
    said = judged(place, table)
    assert said.causes == ("zero",)
    assert said.advice.startswith("Check the reset of the charge amplifier")
    assert said.advice.endswith("then cut again.")


def test_a_difference_of_no_known_shape_is_named_after_nothing(place):
    table = place.record("r90", SLOT)
    # Twice per revolution of the tool, across it: none of the causes has that.
    table["fz_n"] += 25.0 * np.sin(2.0 * np.pi * 200.0 * table["t_s"])
    said = judged(place, table)
    assert (said.status, said.causes) == ("differs", ())
    assert "One run does not show what it is" in said.reasons[1]
    assert said.advice.startswith("Cut again")
    assert "most in z" in said.headline


def test_the_figures_are_those_by_which_the_pipeline_judges_held_out_runs(place):
    force = place.watcher().done.force
    for block in force.problem.role("validate"):
        whole = compared(force, block).whole
        floor = against_floor([scored_unseen(force.fitted, [block])], force.scale)
        assert whole.ratio == pytest.approx(floor.ratio, rel=1e-6)
        assert compared(force, block).as_predicted


def test_a_batch_without_results_is_refused_with_what_to_call(place):
    (place.reports / "verdict.json").unlink()
    with pytest.raises(ContractError, match=r"call: metro run clean-slot"):
        place.watcher()
