"""Force batches of the harder world: effects are what they are said to be, and all causes act."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml

from virtual_cell.blind import RECIPES
from virtual_cell.recipes import force
from virtual_cell.recipes.force_world import HARDER, _drawn, drawn_programme
from virtual_cell.session import spread
from virtual_cell.world.force.cell import cut_run
from virtual_cell.world.force.cutter import effective_runout, uneven
from virtual_cell.world.force.effects import INSIDE
from virtual_cell.world.force.outside import OUTSIDE
from virtual_cell.world.force.people import drawn_habits, order
from virtual_cell.world.force.terms import in_contract_terms, orbit_waves

SEED = 4
SURE = {  # of causes that by chance act in no run
    "loose_bolt": {"axis": 0, "sign": 1.0, "preload_n": 5.0, "share": 0.3},
    "power_sag": {"share": 0.1, "seconds": 0.2, "chance": 1.0},
}


@pytest.fixture(scope="module")
def making():
    return _drawn(SEED, "c", holes=True)[0]


def changed(making, name, parameters=None):
    fresh = replace(making, rng=np.random.default_rng(0))
    return HARDER[name].apply(fresh, parameters or HARDER[name].draw(np.random.default_rng(1), fresh))


def run(cell, plan, seed=5):
    return cut_run(cell, plan, 0.8, 0.9 * cell.metres, np.random.default_rng(seed)).read


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("tool_runout", {"radius_um": 8.0, "angle_deg": 70.0}),
        ("tool_wear", {"edge_growth_per_m": 0.1}),
        ("tool_end", {"corner_radius_mm": 1.5}),
        ("tool_deflection", {"kx_n_um": 4.0, "ky_n_um": 7.0}),
        ("dynamometer_rotation", {"angle_deg": -4.0}),
        ("dynamometer_resonance", {"frequency_hz": [900.0, 1100.0, 1000.0], "damping": [0.03, 0.04, 0.05]}),
        ("charge_drift", {"slope_n_s": [5.0, -3.0, 2.0]}),
        ("charge_drift", {"time_constant_s": [5.0, 8.0, 20.0]}),
    ],
)
def test_what_is_built_comes_to_what_was_asked_for(making, name, parameters):
    made = changed(making, name, parameters)
    term = in_contract_terms(made.cell, made.plans)[name]
    assert set(term.parameters) == set(parameters)
    for key, value in parameters.items():
        np.testing.assert_allclose(term.parameters[key], value, rtol=0.03)
    assert 0.0 <= term.error < 0.6


def test_the_teeth_stand_where_the_truth_says(making):
    teeth = making.cell.tool.teeth
    asked = np.arange(teeth) - np.arange(teeth).mean()
    made = changed(making, "pitch_error", {"pitch_deg": asked.tolist()})
    np.testing.assert_allclose(
        in_contract_terms(made.cell, made.plans)["pitch_error"].parameters["pitch_deg"], asked, atol=1e-3
    )


def test_what_teeth_differ_by_beyond_runout_is_no_offset_of_the_axis(making):
    radial = np.array([3.0, -1.0, 2.0, -4.0]) * 1e-6
    good = replace(making.cell.tool, axial=0.0, twist=0.0, bend=0.0, runout=0.0)
    bare = replace(good, angles=np.arange(4) * np.pi / 2, radial=radial)
    cell = replace(making.cell, tool=bare)
    longer = np.array(in_contract_terms(cell, making.plans)["uneven_teeth"].parameters["longer_um"])
    offset = effective_runout(bare, 0.0)
    rest = bare.radial * 1e6 - (offset * np.exp(-1j * bare.angles)).real * 1e6
    assert longer == pytest.approx(rest - rest.mean(), abs=1e-3)
    assert longer == pytest.approx([2.5, -2.5, 2.5, -2.5], abs=1e-3)
    three = replace(bare, angles=bare.angles[:3], radial=bare.radial[:3], twist=np.zeros(3))
    three = replace(cell, tool=three)
    assert "uneven_teeth" not in in_contract_terms(three, making.plans)


def test_a_lower_tooth_reaches_farther_along_the_corner(making):
    """By as much as it is lower over the tangent of the angle from the tip, in slices of even angle."""
    corner = 1e-3
    height = 1.0 - np.cos(np.radians(18.0 * np.arange(6)))
    middle = 0.5 * (height[1:] + height[:-1])
    out = np.sum(np.diff(height) / np.tan(np.arccos(1.0 - middle)))
    good = replace(making.cell.tool, radial=0.0, twist=0.0, bend=0.0, runout=0.0, corner=corner)
    lower = np.array([1.0, -1.0, 1.0, -1.0]) * 1e-7
    tool = replace(good, angles=np.arange(4) * np.pi / 2, axial=lower)
    longer, apart = uneven(tool, corner)
    assert longer == pytest.approx(out * lower, rel=0.01)
    assert apart > 0.3
    assert uneven(tool, 20 * corner)[0] == pytest.approx(out * lower / 20, rel=0.01)


def test_a_machine_that_sways_makes_the_wave_that_was_asked_for(making):
    made = changed(making, "orbit_stiffness", {"amplitude": 0.06, "phase_deg": 40.0})
    term = in_contract_terms(made.cell, made.plans)["orbit_stiffness"]
    assert term.parameters["amplitude"] == pytest.approx(0.06, rel=0.05)
    assert term.parameters["phase_deg"] == pytest.approx(40.0, abs=2.0)
    with pytest.raises(ValueError, match="no sway"):
        changed(making, "orbit_stiffness", {"amplitude": 9.0, "phase_deg": 0.0})
    helical = next(plan for plan in making.plans if plan.operation == "helical")
    assert abs(orbit_waves(making.cell, helical)[0]) < 0.005


@pytest.mark.parametrize("name", sorted(HARDER))
def test_every_effect_changes_some_run(making, name):
    made = changed(making, name, SURE.get(name))
    plans = [plan for plan in made.plans if plan.role == "identify"]
    chosen = [plans[-1]] if name == "orbit_stiffness" else [plans[-4], plans[-2]]
    for plan in chosen:
        before, after = run(making.cell, plan), run(made.cell, plan)
        if before.shape != after.shape or np.abs(after - before).max() > 2.0:
            return
    pytest.fail(f"{name} changes nothing")


def test_causes_outside_are_of_more_than_ten_kinds_and_of_no_name_in_the_contract():
    assert len(OUTSIDE) >= 10
    assert not set(OUTSIDE) & set(INSIDE)
    assert set(RECIPES["force"].hides("c")) == set(INSIDE) | set(OUTSIDE)
    assert "chipped_tooth" in RECIPES["force"].hides("b")


def test_a_batch_tells_what_was_drawn(tmp_path):
    truth = force.make(tmp_path / "one", {"tool_runout": None}, 12, "d")
    assert set(truth["effects"]) == {"tool_runout"}
    assert set(truth["translation_error"]) == {"tool_runout"}
    assert {"tool_wear", "pitch_error", "dynamometer_resonance"} <= set(truth["always_on"])
    assert set(truth["world"]) == {"spindle", "tool", "metal", "dynamometer", "people"}
    manifest = yaml.safe_load((tmp_path / "one/batch.yaml").read_text())
    assert "hidden" not in manifest
    runs = pd.read_csv(tmp_path / "one/runs.csv")
    assert {"identify", "validate"} == set(runs["role"])
    first = pd.read_parquet(tmp_path / "one" / runs["dynamometer"][0])
    assert (
        np.abs(np.diff(first["t_s"]) * manifest["instruments"]["dynamometer"]["rate_hz"] - 1.0).max() < 0.01
    )


def test_styles_differ_in_what_is_cut_and_how():
    c, d = ([drawn_programme(style, np.random.default_rng(s)) for s in range(60)] for style in "cd")
    assert {one.replicates for one in d} > {one.replicates for one in c}
    assert len({one.feeds for one in d}) > 30 > len({one.feeds for one in c})
    assert {one.shallow for one in c} == {0.5}


def test_repeats_come_in_clumps_where_people_cut_them_so(making):
    habits = replace(drawn_habits(np.random.default_rng(0), clumped=1.0), clumps=True)
    names = [plan.condition for plan, _ in order(making.plans, habits, np.random.default_rng(0))]
    assert sum(a != b for a, b in itertools.pairwise(names)) == len(making.plans) - 1
    loose = replace(habits, clumps=False)
    assert sorted(spread(making.plans, np.random.default_rng(0)), key=str) == sorted(
        order(making.plans, loose, np.random.default_rng(1)), key=str
    )
