"""The effects of a verdict in the model that new runs are compared with, as the virtual cell hid them."""

import json

import pytest
from closed_project import closed_project, without_effects

from metro.commands.simulate import simulate
from metro.loop.fitting.held_out import comparison, held_out
from metro.watch.model import finished

RUNOUT = {"radius_um": 12.0, "angle_deg": 40.0}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Return the folders of a batch whose tool runs out, through the fits of its base models."""
    root = tmp_path_factory.mktemp("runout")
    simulate(
        "try-1",
        kind="force",
        effects=["tool_runout:radius_um=12,angle_deg=40"],
        seed=3,
        style="a",
        root=root / "data/raw",
        truth=root / "truth",
        as_json=True,
    )
    closed_project(root, root / "data/raw/try-1", closing=False)
    without_effects(root, "try-1")
    return root / "data/processed/try-1", root / "reports/try-1"


def stated(folders, effects):
    """Return the model with effects that a verdict states."""
    processed, reports = folders
    content = {"observables": {"force": {"effects": effects}}}
    (reports / "verdict.json").write_text(json.dumps(content))
    return finished("try-1", processed, reports).force


def rms(force):
    rows = comparison(force.problem, held_out(force.problem, force.fitted))
    return float(((rows["measured"] - rows["before"]) ** 2).mean() ** 0.5)


def test_the_effect_that_is_hidden_is_put_back_and_held_out_runs_are_predicted(folders):
    plain = stated(folders, [])
    near = {"radius_um": {"value": 11.0, "ci95": None}, "angle_deg": {"value": 35.0, "ci95": None}}
    found = stated(folders, [{"effect": "tool_runout", "parameters": near}])
    assert rms(found) < 0.2 * rms(plain)
    radius, angle = found.fitted.theta
    assert radius == pytest.approx(RUNOUT["radius_um"], abs=0.2)
    # Which tooth is the first is not observable: the angle is known up to the pitch.
    pitch = 360.0 / found.problem.base.cutter.teeth
    assert (angle - RUNOUT["angle_deg"] + pitch / 2) % pitch - pitch / 2 == pytest.approx(0.0, abs=2.0)


def test_what_the_base_model_misses_is_expected_of_the_next_run_too(folders):
    """Without the runout every run differs; that the next one does, too, is no news."""
    assert stated(folders, []).scale > 2.0


def test_an_effect_without_its_parameters_is_left_out(folders):
    unknown = {"radius_um": {"value": None, "ci95": None}, "angle_deg": {"value": 1.0, "ci95": None}}
    assert stated(folders, [{"effect": "tool_runout", "parameters": unknown}]).fitted.candidate.effects == ()
    assert stated(folders, [{"effect": "no_such_effect", "parameters": {}}]).fitted.candidate.effects == ()
