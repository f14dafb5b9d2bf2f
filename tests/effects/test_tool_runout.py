"""Runout in the force of an independent simulator: found where it is, not found where it is not."""

import math

import numpy as np
import pytest
from blind import clean, closed

from metro.cutting.cutter import Cutter
from metro.cutting.law import EdgeLaw
from metro.effects.tool_runout import EFFECT, apply
from metro.observables.force.model import ForceModel

RADIUS_UM, ANGLE_DEG = 9.0, 40.0


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 5])
def test_hidden_runout_is_found_with_its_radius_and_angle(tmp_path, seed):
    hidden = {"tool_runout": {"radius_um": RADIUS_UM, "angle_deg": ANGLE_DEG}}
    outcome, verdict, teeth = closed(tmp_path, hidden, seed)
    assert "tool_runout" in outcome.names
    found = next(entry for entry in verdict["effects"] if entry["effect"] == "tool_runout")["parameters"]
    radius, angle = found["radius_um"], found["angle_deg"]
    assert radius["value"] == pytest.approx(RADIUS_UM, rel=0.05)
    pitch = 360.0 / teeth
    off = (angle["value"] - ANGLE_DEG + pitch / 2) % pitch - pitch / 2
    assert abs(off) < 3.0
    assert verdict["after"]["rms"] < 0.3 * verdict["before"]["rms"]


@pytest.mark.xdist_group("blind-clean")
def test_no_runout_is_found_in_a_batch_without_it():
    outcome, verdict, _ = clean(3)
    assert "tool_runout" not in outcome.names
    assert verdict["status"] == "clean"


def test_applying_sets_the_cutters_offset_and_touches_nothing_else():
    model = ForceModel(Cutter(6e-3, 0.5, (0.0, math.pi)), EdgeLaw())
    changed = apply(model, {"radius_um": 7.0, "angle_deg": 90.0})
    assert changed.cutter.runout_radius == pytest.approx(7e-6)
    assert changed.cutter.runout_angle == pytest.approx(math.pi / 2)
    assert changed.law == model.law
    assert changed.cutter.radius == model.cutter.radius


def test_starting_angles_go_round_the_whole_turn():
    angle = next(parameter for parameter in EFFECT.parameters if parameter.name == "angle_deg")
    gaps = np.diff([*angle.starts, angle.starts[0] + angle.period])
    assert gaps.max() <= 45.0
    assert angle.upper - angle.lower == angle.period
