"""The effects of a verdict in a prediction: which are put back, and what they change."""

import math

import numpy as np
import pytest

from metro.loaded.force import predict_force
from metro.loaded.found import found
from virtual_cell.chips import Engagement, Tool
from virtual_cell.milling import Cut, forces
from virtual_cell.motion import Straight
from virtual_cell.recipes.slot import ALUMINIUM


def q(value, half):
    return {"value": value, "ci95": None if half is None else [value - half, value + half]}


RUNOUT = {"effect": "tool_runout", "parameters": {"radius_um": q(20.0, 0.5), "angle_deg": q(70.0, 2.0)}}
ROTATED = {"effect": "dynamometer_rotation", "parameters": {"angle_deg": q(3.0, 0.2)}}


SLOT = {"operation": "slot", "feed_per_tooth_mm": 0.09, "axial_depth_mm": 2.0, "radial_depth_mm": 12.0}


def predicted(loaded, effects, spindle=None, **settings):
    """Predict a cut of the loaded batch as if its verdict named these effects."""
    entry = {**loaded.verdict_json["observables"]["force"], "effects": effects}
    spindle = loaded.table("spindle") if spindle is None else spindle
    known = loaded.description, None, loaded.identified_json
    given = SLOT | {"spindle_rpm": 6000.0} | settings
    return predict_force(*known, entry=entry, run=None, spindle=spindle, **given)


def width(force):
    return float((force.table["fx_hi_n"] - force.table["fx_lo_n"]).mean())


def test_what_changes_the_reading_alone_is_left_out():
    taken, notes = found({"effects": [RUNOUT, ROTATED]}, "force")
    assert [each.effect.name for each in taken] == ["tool_runout"]
    assert notes == ["dynamometer rotation is not included: it changes the reading, not the quantity"]


def test_an_effect_without_its_parameters_is_left_out_and_named():
    unknown = {"effect": "tool_runout", "parameters": {"radius_um": q(None, None), "angle_deg": q(1.0, 1.0)}}
    taken, notes = found({"effects": [unknown]}, "force")
    assert taken == []
    assert "not all of its parameters" in notes[0]


def test_a_verdict_that_forbids_its_predictions_says_so_first():
    after = {"rms": 4.0, "nrmse": 0.2, "ci95": [3.0, 5.0]}
    entry = {"status": "unexplained", "unit": "N", "after": after, "noise_floor": 1.0, "effects": [ROTATED]}
    _, notes = found(entry, "force")
    assert notes[0].startswith("do not use the predictions, which have an error of up to 5")
    assert "dynamometer rotation is not included" in notes[1]
    _, notes = found({**entry, "status": "explained"}, "force")
    assert len(notes) == 1


def test_a_form_of_one_joint_is_that_of_the_joint_in_the_verdict():
    scale = {"effect": "stiffness_scale", "parameters": {"joint": "all", "factor": q(0.85, 0.02)}}
    (taken,), _ = found({"effects": [scale]}, "deformation")
    assert dict(taken.effect.where) == {"joint": "all"}
    assert taken.deviations["factor"] == pytest.approx(0.02 / 1.96, rel=1e-3)


def test_runout_changes_the_force_as_it_does_in_the_simulator(loaded):
    tool = Tool(6e-3, math.radians(30.0), np.radians([0.0, 120.0, 240.0]), 20e-6, math.radians(70.0))
    spindle = 100.0 * 2.0 * math.pi
    t = np.arange(6 * 360) * (2.0 * math.pi / 360.0) / spindle
    cut = Cut(
        Engagement(tool, Straight(0.09e-3 * 300.0, 0.1, side="slot", edge=-6e-3), spindle, 0.0, 2e-3),
        ALUMINIUM,
    )
    true = forces(cut, t)[-360:].T
    sure = {"effect": "tool_runout", "parameters": {"radius_um": q(20.0, None), "angle_deg": q(70.0, None)}}
    force, known, plain = (predicted(loaded, effects) for effects in ([RUNOUT], [sure], []))
    assert force.effects == ("tool_runout",)
    first = [
        np.abs(np.fft.rfft(one)[1]) / 180.0 for one in (true[0], force.table["fx_n"], plain.table["fx_n"])
    ]
    assert first[1] == pytest.approx(first[0], rel=0.02)
    assert first[2] < 0.01 * first[0]
    assert width(force) > 1.02 * width(known)  # the error of the radius counts


def test_an_arm_that_gives_way_cuts_less_of_the_wall(loaded):
    """The give that the mean force of the thinner cut makes is the one that makes it thinner."""
    settings = {"operation": "side", "direction": "down", "axial_depth_mm": 4.0, "radial_depth_mm": 3.0}
    spindle = loaded.table("spindle").assign(give_x_mm_n=0.0, give_y_mm_n=2e-3, give_z_mm_n=0.0)
    soft = predicted(loaded, [], spindle, **settings)
    give = 2e-3 * soft.mean_n["y"]
    assert give > 0.1
    rigid = predicted(loaded, [], **{**settings, "radial_depth_mm": 3.0 - give})
    # The give is that of circular paths, whose mean force differs by less than a hundredth.
    near = 0.01 * rigid.peak_n
    assert soft.table["fy_n"].to_numpy() == pytest.approx(rigid.table["fy_n"].to_numpy(), abs=near)
    hard = predicted(loaded, [], **settings)
    assert (soft.table["fy_n"] - hard.table["fy_n"]).abs().max() > 10.0 * near
