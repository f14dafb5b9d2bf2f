"""The slower methods beside the default one, on a tip and a tool made in the test."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from metro.cutting.cutter import Cutter
from metro.dynamics.lobes import spectral_radius, stability_boundary
from metro.dynamics.system import Cut, Structure
from metro.observables.stability import boundary as stability
from metro.observables.stability import methods as lobe_methods
from metro.observables.stability.positions import Tip

TOOL = Cutter(6e-3, 0.0, tuple(np.arange(4) * np.pi / 2), 0.0, 0.0)
STRUCTURE = Structure(
    np.array([0, 0, 1, 1]),
    2 * np.pi * np.array([40.0, 70.0, 45.0, 66.0]),
    np.array([0.05, 0.04, 0.06, 0.03]),
    np.array([4e6, 6e6, 7e6, 5e6]),
)
TIP = Tip("1", STRUCTURE, ("x1", "x2", "y1", "y2"), np.full(12, 0.01))
FOUND = stability.Cutting(2e9, 8e8, np.array([0.02, 0.02]), TOOL)
RPM = np.linspace(600, 1500, 31)
FEED = 0.05e-3


def first(**changes):
    row = {"operation": "side", "direction": "down", "radial_depth_mm": 3.0, "feed_direction_deg": 0.0}
    return pd.Series({**row, **changes})


def solved(tip=TIP, **changes):
    return stability.solve(tip, FOUND, first(**changes), RPM, check=False)


@pytest.fixture(scope="module")
def lobes():
    return stability.solve(TIP, FOUND, first(), RPM, check=True)


@pytest.fixture(scope="module")
def every(lobes):
    return lobe_methods.methods(lobes, TOOL, FEED)


@pytest.fixture(scope="module")
def methods(every):
    return every[every["checked"]]


def test_semidiscretisation_agrees_to_a_thousandth_of_depth(methods):
    np.testing.assert_allclose(methods["semidiscretisation_mm"], methods["depth_mm"], rtol=1e-3)


def test_the_slow_methods_are_solved_at_every_few_speeds(every):
    np.testing.assert_allclose(every["rpm"], RPM)
    assert 0 < every["checked"].sum() < len(RPM) / 4
    assert every.loc[~every["checked"], ["cdsem_mm", "tool_mm"]].isna().all(axis=None)


def test_the_governing_mode_is_the_one_whose_lobe_is_the_lowest(methods, lobes):
    alone = np.stack(
        [stability_boundary(STRUCTURE.mode(i), lobes.cuts[0], methods["rpm"]).depth for i in range(4)]
    )
    np.testing.assert_allclose(methods["single_mode_mm"], alone.min(axis=0) * 1e3, rtol=1e-9)
    assert list(methods["governing_mode"]) == [TIP.names[i] for i in alone.argmin(axis=0)]


def test_cdsem_is_near_the_single_modes_and_not_equal(methods):
    ratio = methods["cdsem_mm"] / methods["single_mode_mm"]
    assert np.all(np.abs(ratio - 1) < 0.03)
    assert np.any(np.abs(ratio - 1) > 1e-5)


def test_a_plain_tool_is_what_the_default_method_assumes(methods):
    np.testing.assert_array_equal(methods["tool_mm"], methods["semidiscretisation_mm"])


def test_a_helix_changes_the_boundary_of_an_intermittent_cut_a_little_and_is_told(lobes, methods):
    tool = replace(TOOL, helix=np.radians(40))
    table = lobe_methods.methods(lobes, tool, FEED)
    change = 100 * (table.loc[methods.index, "tool_mm"] / methods["depth_mm"] - 1)
    assert 0.01 < change.abs().max() < 10
    (note,) = lobe_methods.left_out(table, tool)
    assert "the boundary is that of the tool without its helix of 40°" in note
    assert f"moves the depth by {change.min():.2g} to {change.max():.2g} %" in note


def test_what_the_tool_has_and_the_default_method_leaves_out_is_named():
    columns = {
        "position": "4",
        "depth_mm": 0.5,
        "checked": [True, False, True],
        "tool_mm": [0.5, np.nan, 0.51],
    }
    table = pd.DataFrame(columns)
    assert lobe_methods.left_out(table, TOOL) == []
    start = "position 4: the boundary is that of the tool without its"
    assert lobe_methods.left_out(table, replace(TOOL, helix=0.5, runout_radius=1e-6)) == [
        f"{start} helix of 28.6° and its runout; with it semi-discretisation moves the depth by 0 to 2 %, "
        "1 % in the median, over 2 speeds"
    ]
    uneven = replace(TOOL, tooth_angles=tuple(np.radians([0, 80, 180, 260])))
    assert lobe_methods.left_out(table.assign(tool_mm=0.5), uneven)[0].endswith(
        "by less than 0.001 %, over 2 speeds"
    )
    assert lobe_methods.left_out(table.assign(tool_mm=np.nan), uneven) == [
        f"{start} uneven pitch; at 2 of 2 speeds semi-discretisation with it finds no boundary near"
    ]


def test_an_uneven_pitch_keeps_its_windows_when_the_feed_is_turned():
    tool = replace(TOOL, tooth_angles=tuple(np.radians([0, 80, 180, 260])))
    plain = lobe_methods.real_teeth(Cut(4, 2.0, 3.0, 1e9, 4e8), 0.0, tool, FEED)
    turned = lobe_methods.real_teeth(Cut(4, 1.5, 2.5, 1e9, 4e8), 0.5, tool, FEED)
    assert [w.delay for w in plain.windows] == pytest.approx(list(np.radians([80, 100, 80, 100])))
    assert [w.entry + 0.5 for w in turned.windows] == pytest.approx([w.entry for w in plain.windows])


def test_runout_beyond_the_feed_leaves_teeth_out():
    tool = replace(TOOL, runout_radius=0.3e-3)
    found = lobe_methods.real_teeth(Cut(4, 2.0, 3.0, 1e9, 4e8), 0.0, tool, FEED)
    assert len({w.angle for w in found.windows}) < 4
    assert max(w.delay for w in found.windows) > np.pi


def test_islands_are_stable_and_lie_above_the_boundary():
    rpm = np.linspace(1180, 1260, 9)
    lobes = stability.solve(TIP, FOUND, first(direction="up", radial_depth_mm=6.0), rpm, check=False)
    deepest = 4 * lobes.boundary.depth.min()
    found = lobe_methods.islands(lobes, deepest)
    for _, row in found.iterrows():
        at = np.searchsorted(rpm, row["rpm"])
        middle = np.array([(row["from_mm"] + row["to_mm"]) / 2e3])
        assert spectral_radius(STRUCTURE, lobes.cuts[0], rpm[[at]], middle)[0] < 1
        assert row["from_mm"] > lobes.boundary.depth[at] * 1e3


def test_each_station_is_told_by_the_others():
    where = {name: np.array([x, 0.0, 0.0]) for name, x in (("1", 0.0), ("2", 0.2), ("3", 0.4))}
    softer = [replace(STRUCTURE, stiffness=STRUCTURE.stiffness * np.exp(-x[0])) for x in where.values()]
    every = [solved(replace(TIP, position=p, structure=s)) for p, s in zip(where, softer, strict=True)]
    table = lobe_methods.stations(every, where).set_index("position")
    # stiffness is log-linear along x: the middle one is told exactly, the ends lie too far out to be told
    assert table.loc["2", "depth_error_percent"] == pytest.approx(0.0, abs=1e-6)
    assert table.loc["2", "lowest_from_others_mm"] == pytest.approx(table.loc["2", "lowest_mm"])
    assert np.isnan(table.loc["1", "depth_error_percent"])


def test_one_station_alone_is_not_told():
    assert lobe_methods.stations([solved()], {"1": np.zeros(3)}).empty


def test_directions_that_push_alike_are_solved_once():
    # four teeth in a slot: the factors do not change with time, and turning them changes nothing
    assert len(solved(operation="helical").cuts) == 1
    three = replace(FOUND, tool=replace(TOOL, tooth_angles=tuple(np.arange(3) * 2 * np.pi / 3)))
    lobes = stability.solve(TIP, three, first(operation="helical"), RPM[:4], check=False)
    assert len(lobes.cuts) == stability.ORBIT_DIRECTIONS
    lowest = np.min([stability_boundary(STRUCTURE, cut, RPM[:4]).depth for cut in lobes.cuts], axis=0)
    np.testing.assert_array_equal(lobes.boundary.depth, lowest)


def test_the_inner_band_holds_what_modes_and_coefficients_leave_open(lobes):
    table = stability.diagram(lobes)
    inside = (table["depth_p05_mm"] < table["depth_mm"]) & (table["depth_mm"] < table["depth_p95_mm"])
    assert inside.all()
    assert np.all(table["depth_lo_mm"] < table["depth_p05_mm"])
    assert np.all(table["depth_hi_mm"] > table["depth_p95_mm"])
    assert len(lobes.samples) >= 500


def test_the_worth_of_the_bands_is_told(lobes):
    [words] = stability.worth([lobes])
    assert "first order" in words
    assert f"{lobes.anew.size} depths" in words
    assert np.median(np.abs(np.log(lobes.anew))) < 0.02


def test_boundaries_are_sought_no_deeper_than_four_times_the_lowest(lobes):
    lowest = lobes.boundary.depth.min()
    assert stability.deepest(lobes, pd.DataFrame({"axial_depth_mm": [1e3]})) == pytest.approx(4 * lowest)
    assert stability.deepest(lobes, pd.DataFrame({"axial_depth_mm": [1e-3]})) >= 2.5 * lowest


def test_where_semidiscretisation_finds_no_boundary_at_any_speed_the_rest_is_there():
    """An arm of 8 Hz at 9000 rev/min is stable to depths at which the helix wraps the tool many times."""
    arm = replace(STRUCTURE, omega=2 * np.pi * np.array([8.0, 8.4, 10.4, 11.0]), stiffness=np.full(4, 1e6))
    cut = stability.solve(
        replace(TIP, structure=arm), FOUND, first(radial_depth_mm=6.0), np.array([9e3]), check=False
    )
    (row,) = lobe_methods.methods(cut, replace(TOOL, helix=np.radians(30.0)), FEED).to_dict("records")
    assert row["semidiscretisation_mm"] == pytest.approx(row["depth_mm"], rel=1e-3)
    assert np.isnan(row["tool_mm"])
