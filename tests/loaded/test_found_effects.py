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


def test_what_changes_the_reading_alone_is_left_out():
    taken, notes = found({"effects": [RUNOUT, ROTATED]}, "force")
    assert [each.effect.name for each in taken] == ["tool_runout"]
    assert notes == ["dynamometer rotation is not included: it changes the reading, not the quantity"]


def test_an_effect_without_its_parameters_is_left_out_and_named():
    unknown = {"effect": "tool_runout", "parameters": {"radius_um": q(None, None), "angle_deg": q(1.0, 1.0)}}
    taken, notes = found({"effects": [unknown]}, "force")
    assert taken == []
    assert "not all of its parameters" in notes[0]


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
    entry = {**loaded.verdict_json["observables"]["force"], "effects": [RUNOUT]}
    settings = {
        "operation": "slot",
        "feed_per_tooth_mm": 0.09,
        "axial_depth_mm": 2.0,
        "radial_depth_mm": 12.0,
    }
    force, plain = (
        predict_force(
            loaded.description,
            None,
            loaded.identified_json,
            entry=each,
            run=None,
            spindle=loaded.table("spindle"),
            spindle_rpm=6000.0,
            **settings,
        )
        for each in (entry, {**entry, "effects": []})
    )
    assert force.effects == ("tool_runout",)
    first = [
        np.abs(np.fft.rfft(one)[1]) / 180.0 for one in (true[0], force.table["fx_n"], plain.table["fx_n"])
    ]
    assert first[1] == pytest.approx(first[0], rel=0.02)
    assert first[2] < 0.01 * first[0]
    wide = (force.table["fx_hi_n"] - force.table["fx_lo_n"]).mean()
    assert wide > 1.02 * (plain.table["fx_hi_n"] - plain.table["fx_lo_n"]).mean()
