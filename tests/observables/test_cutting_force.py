"""Cutting conditions of a batch in SI, and the mean force that follows from declared coefficients."""

import math

import numpy as np
import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.observables.cut import conditions as cutting_force
from metro.observables.problem import Refusal

TOOL = {"diameter_mm": 12.0, "teeth": 4, "helix_deg": 40.0}
DECLARED = {
    "ktc_n_mm2": 10145,
    "krc_n_mm2": 11036.5,
    "kac_n_mm2": 5000,
    "kte_n_mm": 591.92,
    "kre_n_mm": 100.03,
    "kae_n_mm": 214.32,
}


def batch(manifest, **row):
    settings = {
        "operation": "slot",
        "direction": "slot",
        "feed_per_tooth_mm": 0.06,
        "axial_depth_mm": 0.2,
        "radial_depth_mm": math.nan,
        "feed_direction_deg": math.nan,
    } | row
    runs = pd.DataFrame([settings], index=pd.Index(["r1"], name="run"))
    return Batch("small", manifest, {"cell": "none"}, runs, {})


def test_the_published_mean_slot_force_follows_from_the_declared_coefficients():
    one = batch({"tool": TOOL, "coefficients": DECLARED})
    values = cutting_force.coefficients(one, {})
    found = cutting_force.mean_force_on_tool(one, "r1", values)
    assert found[1] == pytest.approx(272.47, abs=0.02)


def test_the_force_turns_with_the_direction_of_feed():
    one = batch({"tool": TOOL, "coefficients": DECLARED})
    across = batch({"tool": TOOL, "coefficients": DECLARED}, feed_direction_deg=90.0)
    x, y, z = cutting_force.mean_force_on_tool(one, "r1", cutting_force.coefficients(one, {}))
    turned = cutting_force.mean_force_on_tool(across, "r1", cutting_force.coefficients(across, {}))
    assert turned == pytest.approx([-y, x, z])


def test_edge_coefficients_declared_per_arc_of_edge_are_larger_per_axial_depth():
    arc = cutting_force.coefficients(
        batch({"tool": TOOL, "coefficients": DECLARED | {"edge_length": "arc"}}), {}
    )
    assert arc["ktc"] == 10145
    assert arc["kte"] == pytest.approx(591.92 / math.cos(math.radians(40.0)))


def test_coefficients_of_the_batchs_own_forces_serve_where_none_are_declared():
    found = {
        "force": {"waveform": {name: {"value": 7.0} for name in ("ktc", "krc", "kac", "kte", "kre", "kae")}}
    }
    assert cutting_force.coefficients(batch({"tool": TOOL}), found)["kre"] == 7.0
    refused = cutting_force.coefficients(batch({"tool": TOOL, "coefficients": {"ktc_n_mm2": 1.0}}), {})
    assert isinstance(refused, Refusal)
    assert "krc, kac, kte, kre, kae" in refused.reason


def test_half_of_a_runout_is_none():
    tool = cutting_force.cutter(batch({"tool": TOOL, "known": {"tool_runout": {"radius_um": 7.35}}}))
    assert (tool.runout_radius, tool.runout_angle) == (0.0, 0.0)


def test_the_tool_is_in_si_with_the_runout_that_is_known():
    known = {"tool_runout": {"radius_um": 7.35, "angle_deg": 40.0}}
    tool = cutting_force.cutter(batch({"tool": TOOL | {"pitch_deg": [80, 100, 80, 100]}, "known": known}))
    assert tool.radius == pytest.approx(6e-3)
    assert tool.helix == pytest.approx(math.radians(40.0))
    assert tool.tooth_angles == pytest.approx(np.radians([0, 80, 180, 260]))
    assert tool.runout_radius == pytest.approx(7.35e-6)
    assert tool.runout_angle == pytest.approx(math.radians(40.0))


def test_a_tool_without_teeth_is_refused_by_its_key():
    assert (
        cutting_force.cutter(batch({"tool": {"diameter_mm": 12}})).reason
        == "batch.yaml: tool.teeth is not given"
    )


def test_a_side_cut_keeps_its_radial_depth_and_a_slot_needs_none():
    side = cutting_force.cut(batch({}, operation="side", direction="down", radial_depth_mm=3.0), "r1", 6e-3)
    assert side.engagement.entry == pytest.approx(math.pi - math.acos(0.5))
    assert side.feed_per_tooth == pytest.approx(0.06e-3)
    assert cutting_force.cut(batch({}), "r1", 6e-3).engagement.exit == pytest.approx(math.pi)


def test_a_turn_about_z_is_counter_clockwise():
    assert cutting_force.turn_about_z(math.pi / 2) @ [1.0, 0.0, 0.0] == pytest.approx([0.0, 1.0, 0.0])


@pytest.mark.parametrize(
    ("setting", "blank"),
    [
        ("feed_per_tooth_mm", np.nan),
        ("axial_depth_mm", np.nan),
        ("direction", ""),
        ("radial_depth_mm", np.nan),
    ],
)
def test_a_side_cut_that_is_not_described_has_no_force_and_says_which_setting_is_blank(setting, blank):
    settings = {
        "operation": "side",
        "feed_per_tooth_mm": 0.05,
        "axial_depth_mm": 2.0,
        "radial_depth_mm": 3.0,
        "direction": "up",
        "spindle_rpm": 3000.0,
    }
    runs = pd.DataFrame([settings | {setting: blank}], index=["r1"])
    bare = Batch("b", {"tool": {"diameter_mm": 10, "teeth": 2}}, {"cell": "c"}, runs, {})
    with pytest.raises(ValueError, match=f"^runs.csv: {setting} of run r1 is blank$"):
        cutting_force.cut(bare, "r1", 5e-3)
