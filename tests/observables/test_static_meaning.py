"""When a static deflection has no meaning: the gain of the iteration, and teeth that pass above the modes."""

import numpy as np
import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.observables.force.static_meaning import static_deflection
from metro.observables.force.yielding_table import gains

KTC, KRC = 10000.0, 5000.0  # N/mm²
COEFFICIENTS = {f"k{a}{b}_n_mm{'2' * (b == 'c')}": 0.0 for a in "tra" for b in "ce"}
COEFFICIENTS |= {"ktc_n_mm2": KTC, "krc_n_mm2": KRC}


def batch(depth=0.2, rpm=2000.0):
    runs = pd.DataFrame(
        {
            "operation": "slot", "direction": "slot", "spindle_rpm": rpm, "feed_per_tooth_mm": 0.05,
            "axial_depth_mm": depth, "radial_depth_mm": 12.0, "feed_direction_deg": 0.0, "pose": "1",
            "dynamometer": "a.csv", "orbit_rpm": np.nan, "order": [1, 2],
        },
        index=pd.Index(["a", "b"], name="run"),
    )  # fmt: skip
    tool = {"diameter_mm": 12, "teeth": 4, "helix_deg": 0}
    manifest = {"tool": tool, "coefficients": COEFFICIENTS, "work_in_base": {"xyz_mm": [0, 0, 0]}}
    manifest["work_in_base"]["rpy_deg"] = [0, 0, 0]
    return Batch("b", manifest, {"cell": "c"}, runs, {})


def tables(stiffness):
    k = {f"k{axis}_n_um": [stiffness] for axis in "xyz"}
    stations = pd.DataFrame({"position": ["1"], "x_mm": [0.0], "y_mm": [0.0], "z_mm": [0.0], **k})
    return lambda *_: stations


def modes(frequency, stiffness=1e6, damping=1e-4):
    value = {"frequency": frequency, "damping": damping, "stiffness": stiffness}
    return [{"position": "1", "direction": "x"} | {name: {"value": v} for name, v in value.items()}]


@pytest.mark.parametrize("stiffness", [2.0, 8.0])
def test_the_gain_is_that_of_a_slot_in_closed_form(stiffness):
    # Two teeth at right angles are in the cut: the slope is depth × [−K_rc −K_tc; K_tc −K_rc] at any angle.
    expected = 0.2 * np.hypot(KTC, KRC) / (1e3 * stiffness)
    found = gains(batch(), tables(stiffness), {})["gain"]
    assert list(found) == pytest.approx([expected] * 2, rel=5e-3)


def test_a_stiff_machine_whose_modes_are_far_above_the_teeth_yields_statically():
    said = static_deflection(batch(), tables(100.0), {"modes": modes(1000.0)})
    assert said == {"runs": [], "reason": ""}


def test_a_gain_above_one_is_said_with_its_figure():
    said = static_deflection(batch(), tables(1.0), {})
    assert said["runs"] == ["a", "b"]
    assert said["iteration_gain"] == pytest.approx(0.2 * np.hypot(KTC, KRC) / 1e3, rel=5e-3)
    assert "2.24 in each step" in said["reason"]
    assert "the teeth pass" not in said["reason"]


@pytest.mark.parametrize(("share", "denied"), [(0.29, False), (0.32, True), (2.0, True)])
def test_teeth_that_pass_faster_than_three_tenths_of_a_mode_are_no_static_load(share, denied):
    natural = (4 * 2000.0 / 60.0) / share
    said = static_deflection(batch(), tables(100.0), {"modes": modes(natural)})
    assert bool(said["runs"]) == denied
    if denied:
        assert said["moves"] == pytest.approx(abs(1.0 / (1.0 - share**2)), rel=1e-3)
        assert "133 Hz" in said["reason"]


def test_without_stations_nothing_is_said():
    assert static_deflection(batch(), lambda *_: pd.DataFrame({"position": []}), {}) == {}
