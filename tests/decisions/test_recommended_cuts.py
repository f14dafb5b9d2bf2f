"""Cuts to use: pockets on a drawn boundary, closed forms of what they take, and when not to use them."""

import math

import numpy as np
import pandas as pd
import pytest

from metro.decisions.cuts import Milling, Reach, recommended_cuts
from virtual_cell.chips import Engagement, Tool
from virtual_cell.milling import Cut, in_millimetres, power
from virtual_cell.motion import Straight

MANIFEST = {
    "tool": {"diameter_mm": 12.0, "teeth": 3},
    "coefficients": {"ktc_n_mm2": 900.0, "kte_n_mm": 15.0},
}
MILLING = Milling.of(MANIFEST, {})
CUT = {"operation": "side", "direction": "down", "radial_depth_mm": 4.0, "feed_direction_deg": 0.0}
RPM = np.arange(1000.0, 5001.0, 100.0)


def boundary(low=None):
    low = 0.2 + 0.8 * np.exp(-(((RPM - 3000.0) / 300.0) ** 2)) if low is None else low
    table = pd.DataFrame({"position": "1", "rpm": RPM, "depth_mm": 1.3 * low, "depth_lo_mm": low})
    return table.assign(chatter_hz=640.0, feed_per_tooth_mm=0.1, **CUT)


def table_of(depths=(), unstable=(), rpm=3000.0, ends=True, **changed):
    """Return tests at these depths, and one that was far too deep at each end of the speeds."""
    tests = pd.DataFrame({"rpm": rpm, "depth_mm": depths, "unstable": unstable})
    deep = pd.DataFrame({"rpm": [RPM[0], RPM[-1]], "depth_mm": 9.0, "unstable": 1})
    every = pd.concat([tests, deep] if ends else [tests], ignore_index=True)
    return every.assign(position="1", own_modes=True, **{**CUT, **changed})


def cuts(low=None, tested=None, status="clean", limits=None, **reach):
    tested = table_of() if tested is None else tested
    return recommended_cuts(boundary(low), tested, status, MILLING, Reach(limits or {}, **reach))


def test_the_pocket_is_found_at_the_depth_of_its_worst_neighbour():
    pocket = next(cut for cut in cuts() if cut["spindle_rpm"] == 3000.0)
    assert pocket["axial_depth_mm"] == pytest.approx(0.2 + 0.8 * math.exp(-1.0 / 9.0))
    removal = 4.0 * pocket["axial_depth_mm"] * 0.1 * 3 * 3000.0 / 1000.0
    assert pocket["removal_cm3_min"] == pytest.approx(removal)
    assert pocket["chatter_hz"] == 640.0


def test_the_largest_removal_comes_first_and_there_are_few():
    removal = [cut["removal_cm3_min"] for cut in cuts()]
    assert removal == sorted(removal, reverse=True)
    assert 1 <= len(removal) <= 3


def test_limits_of_the_machine_hold():
    found = cuts(limits={"spindle_rpm": [1000, 2500], "axial_depth_mm": [0.1, 0.15]})
    assert all(cut["spindle_rpm"] <= 2500.0 for cut in found)
    assert {cut["axial_depth_mm"] for cut in found} == {0.15}
    assert cuts(limits={"axial_depth_mm": [2.0, 3.0]}) == []


def test_no_cut_is_deeper_than_the_runs_and_the_work_tell():
    runs, none = (
        pd.DataFrame({"axial_depth_mm": [0.5, 2.0]}),
        pd.DataFrame({"position": [], "frequency_hz": []}),
    )
    known = Reach.of({"work": {"size_mm": [100, 60, 3.0]}}, runs, none)
    assert (known.deepest_mm, known.highest_hz) == (3.0, {})
    assert Reach.of({}, runs, none).deepest_mm == 4.0
    found = cuts(low=np.full(len(RPM), 60.0), deepest_mm=4.0)
    assert {(cut["axial_depth_mm"], cut["at_reach"]) for cut in found} == {(4.0, True)}
    (stated,) = {
        cut["at_reach"] for cut in cuts(low=np.full(len(RPM), 60.0), limits={"axial_depth_mm": [1, 9]})
    }
    assert not stated


def test_no_cut_is_named_where_the_teeth_pass_faster_than_the_hammer_reached():
    frf = pd.DataFrame({"position": ["1", "1", "2"], "frequency_hz": [20.0, 130.0, 900.0]})
    frf = frf.assign(reference="1x", response="1x")
    highest = Reach.of({}, pd.DataFrame({"axial_depth_mm": [1.0]}), frf).highest_hz
    assert highest == {"1": 130.0, "2": 900.0}
    assert all(cut["spindle_rpm"] * 3 / 60.0 <= 130.0 for cut in cuts(highest_hz=highest))
    assert cuts(highest_hz={"1": 40.0}) == []


def test_no_cut_is_recommended_for_a_tool_that_was_struck_in_one_direction():
    """Of a real slot, with receptances along x alone, 6 mm were recommended at a probability of 0.975."""
    rows = [("1", "1x", "1x"), ("1", "2x", "1x"), ("1", "1y", "1x"), ("2", "1x", "1x"), ("2", "1y", "1y")]
    rows += [("3", "1z", "1z"), ("3", "2x", "1x")]
    frf = pd.DataFrame(rows, columns=["position", "reference", "response"]).assign(frequency_hz=900.0)
    struck = Reach.of({}, pd.DataFrame({"axial_depth_mm": [1.0]}), frf).struck
    assert struck == {"1": "x", "2": "xy", "3": "xz"}
    assert {(cut["advice"], cut["why"]) for cut in cuts(struck={"1": "x"})} == {
        ("do_not", "struck_in_one_direction")
    }
    assert cuts(struck={"1": "xz"}) == cuts()


def test_no_cut_is_recommended_by_a_coefficient_that_may_be_zero():
    coefficients = {"krc": {"value": 1.0}, "kte": {"value": 1.0}, "kre": {"value": 1.0}}
    known = {"force": {"waveform": {**coefficients, "ktc": {"value": 900.0, "ci95": [400.0, 1400.0]}}}}
    unsure = {"force": {"waveform": {**coefficients, "ktc": {"value": 900.0, "ci95": [-400.0, 2200.0]}}}}
    tool = {"tool": MANIFEST["tool"]}
    assert Milling.of(tool, known).sure
    assert not Milling.of(tool, unsure).sure
    assert Milling.of(MANIFEST, unsure).sure  # declared
    found = recommended_cuts(
        boundary(np.full(len(RPM), 1.0)), table_of([], []), None, Milling.of(tool, unsure), Reach({})
    )
    assert {(cut["advice"], cut["why"]) for cut in found} == {("do_not", "force_not_known")}


@pytest.mark.parametrize(("direction", "side"), [("down", "down"), ("up", "up")])
def test_power_is_that_of_the_simulator(direction, side):
    """Mean of what the simulator's spindle delivers, traced tooth by tooth.

    Its teeth travel on trochoids, which make arc and speed differ by the feed per radian over the radius.
    """
    difference = 3 * 0.1e-3 / (2.0 * math.pi * 6e-3)
    tool = Tool(6e-3, 0.0, np.radians([0.0, 120.0, 240.0]))
    spindle = 3000.0 * 2.0 * math.pi / 60.0
    motion = Straight(0.1e-3 * 3 * 50.0, 0.1, side=side, edge=2e-3)
    metal = in_millimetres((900.0, 300.0, 0.0), (15.0, 10.0, 0.0))
    t = np.arange(4 * 7200) * (2.0 * math.pi / 7200.0) / spindle
    true = power(Cut(Engagement(tool, motion, spindle, 0.0, 1e-3), metal), t)[-7200:].mean()
    torque = 1e-3 * MILLING.torque("side", direction, 4e-3, 0.1e-3)
    assert torque * spindle == pytest.approx(true, rel=1.5 * difference)


def test_a_slot_takes_the_closed_form():
    """T = N a R (2 K_tc c + π K_te)/(2π)."""
    expected = 3 * 6e-3 * (2.0 * 9e8 * 1e-4 + math.pi * 1.5e4) / (2.0 * math.pi)
    assert MILLING.torque("slot", "slot", 12e-3, 1e-4) == pytest.approx(expected)


def test_a_hole_is_removed_as_a_whole():
    """Volume per orbit π R_h² a over the length of the orbit of the tool's centre, and the depth."""
    hole = Milling(6e-3, 4, 1.0, 1.0, hole_radius=9.5e-3)
    width = math.pi * 9.5e-3**2 / (2.0 * math.pi * 3.5e-3)
    assert hole.width("helical", 12e-3) == pytest.approx(width)


def test_edge_coefficients_per_arc_are_converted():
    per_arc = {"coefficients": {**MANIFEST["coefficients"], "edge_length": "arc"}}
    tool = {"tool": {**MANIFEST["tool"], "helix_deg": 60.0}}
    assert Milling.of({**tool, **per_arc}, {}).kte == pytest.approx(2.0 * MILLING.kte)


def test_without_coefficients_or_tool_there_are_none():
    assert Milling.of({"tool": MANIFEST["tool"]}, {}) is None
    assert Milling.of({"coefficients": MANIFEST["coefficients"]}, {}) is None
    identified = {"force": {"waveform": {"ktc": {"value": 900.0}, "kte": {"value": 15.0}}}}
    assert Milling.of({"tool": MANIFEST["tool"]}, identified) == MILLING


@pytest.mark.parametrize(
    ("tested", "status", "advice", "why"),
    [
        (table_of([0.5, 0.6], [0, 0]), "clean", "use", "tests_confirm_the_band"),
        (table_of([0.5, 0.6], [0, 0]), "insufficient", "try", "too_few_tests"),
        (table_of(), None, "try", "no_test_below_the_band"),
        (table_of([0.5], [0], radial_depth_mm=9.0), "clean", "try", "no_test_below_the_band"),  # another cut
        (
            table_of([0.5], [-1]),
            "clean",
            "try",
            "no_test_below_the_band",
        ),  # unknown
        (table_of([0.5, 0.6], [1, 0]), "clean", "do_not", "tests_chatter_below_the_band"),
        (table_of([0.5], [0]), "unexplained", "do_not", "verdict_unexplained"),
        (table_of([0.5], [0]), "undetermined", "do_not", "verdict_undetermined"),
        (
            table_of([3.0, 4.0], [1, 1]),
            "clean",
            "try",
            "no_test_below_the_band",
        ),  # chatter where it is predicted
    ],
)
def test_what_to_do_follows_from_the_tests_and_the_verdict(tested, status, advice, why):
    assert {(cut["advice"], cut["why"]) for cut in cuts(tested=tested, status=status)} == {(advice, why)}


def test_one_chattering_test_among_many_stable_ones_is_chance():
    """P(1 or more of 40 at 2.5 %) = 1 − 0.975⁴⁰ = 0.64; of 1 it is 0.025."""
    many = table_of([0.5] * 40, [1] + [0] * 39)
    assert cuts(tested=many)[0]["advice"] == "use"
    assert cuts(tested=table_of([0.5], [1]))[0]["advice"] == "do_not"


def test_a_speed_outside_those_of_the_tests_is_tried_with_care():
    tested = table_of([0.15] * 6, [0] * 6, rpm=2900.0, ends=False)
    assert {(cut["advice"], cut["why"]) for cut in cuts(tested=tested)} == {
        ("try", "no_test_at_such_a_speed")
    }


@pytest.mark.parametrize("teeth", [1, 2])
def test_the_bending_moment_of_a_slot_is_that_of_its_thickest_chip(teeth):
    """One tooth without a helix at a time: at 90° the force is the root of the squares of both components."""
    tool = {"diameter_mm": 12.0, "teeth": teeth, "overhang_mm": 45.0}
    coefficients = {"ktc_n_mm2": 900.0, "krc_n_mm2": 300.0, "kte_n_mm": 15.0, "kre_n_mm": 20.0}
    milling = Milling.of({"tool": tool, "coefficients": coefficients}, {})
    feed, depth = 0.08, 1.5
    force = depth * math.hypot(900.0 * feed + 15.0, 300.0 * feed + 20.0)
    expected = force * 1e-3 * (45.0 - 0.5 * depth)
    found = milling.bending("slot", "slot", 12e-3, feed * 1e-3, depth * 1e-3)
    assert found == pytest.approx(expected, rel=1e-4)


def test_without_an_overhang_or_a_radial_coefficient_no_bending_is_stated():
    assert MILLING.bending("slot", "slot", 12e-3, 1e-4, 1e-3) is None
    assert all(cut["bending_nm"] is None for cut in cuts())
    tool = {**MANIFEST["tool"], "overhang_mm": 45.0}
    assert Milling.of({**MANIFEST, "tool": tool}, {}).lateral is None
