"""The tool's end as a candidate effect, and the drift that no record shows."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.force import Cut
from metro.cutting.law import EdgeLaw
from metro.effects import charge_drift, tool_end
from metro.observables.force.dynamometer import Recording
from metro.observables.force.model import ForceModel, ForceSetting, Structure
from metro.observables.problem import Refusal

R = 5e-3
MODEL = ForceModel(Cutter(R, 0.6, evenly_pitched(2)), EdgeLaw())
BETA = np.array([900e6, 300e6, -200e6, 15e3, 20e3, -2e3])
RECORDING = Recording((0.5,), 1.0, 20.0)


def setting(depth, recording=RECORDING):
    return ForceSetting(Cut(0.05e-3, depth, Engagement(0.0, np.pi)), 0.0, 12, recording, 0.0)


def problem(depths, model=MODEL, recordings=None):
    recordings = recordings or [RECORDING] * len(depths)
    blocks = tuple(
        SimpleNamespace(setting=setting(depth, recording), role="identify", zeros=np.zeros((1, 3)))
        for depth, recording in zip(depths, recordings, strict=True)
    )
    return SimpleNamespace(base=model, blocks=blocks, role=lambda _: blocks)


def test_it_is_not_tried_where_the_end_is_declared_or_the_depth_never_changes():
    declared = replace(MODEL, end_declared=True)
    assert tool_end.adapt(tool_end.EFFECT, problem([1e-3, 2e-3], declared)) == Refusal("")
    assert "one depth" in tool_end.adapt(tool_end.EFFECT, problem([1e-3, 1.1e-3])).reason


def test_it_reaches_from_a_flat_end_to_a_ball():
    effect = tool_end.adapt(tool_end.EFFECT, problem([1e-3, 2e-3]))
    (corner,) = effect.parameters
    assert (corner.lower, corner.upper) == (0.0, pytest.approx(5.0))
    assert corner.nothing_above
    assert effect.apply(MODEL, {"corner_radius_mm": 0.0}).cutter == MODEL.cutter
    assert effect.apply(MODEL, {"corner_radius_mm": 5.0}).cutter.corner == R
    assert effect.apply(MODEL, {"corner_radius_mm": 9.0}).cutter.corner == R


def test_a_yielding_tool_with_a_corner_has_the_force_of_both():
    springs = Structure(compliance=(1e-9, 1e-9))
    ball = replace(MODEL, cutter=replace(MODEL.cutter, corner=R))
    stiff = ball._force(setting(2e-3), BETA)
    yields = replace(ball, structure=springs)._force(setting(2e-3), BETA)
    assert yields == pytest.approx(stiff, rel=0.02, abs=0.02 * np.abs(stiff).max())
    assert np.abs(yields - stiff).max() > 0.0


def read(slope, sd):
    return replace(RECORDING, slope=(0.0, 0.0, slope), slope_sd=(0.5, 0.5, sd))


def test_no_drift_is_faster_than_the_means_of_the_revolutions():
    seen = [read(slope, 3.0) for slope in (-0.7, 1.7, 8.5, -17.9, -4.7)]
    effect = charge_drift.adapt(charge_drift.EFFECT, problem([1e-3] * 5, recordings=seen))
    z = effect.parameters[2]
    assert -60.0 < z.lower < 0.0 < z.upper < 60.0
    assert effect.parameters[0].upper < 2.0


def test_a_drift_that_all_records_show_is_within_the_bounds():
    seen = [read(slope, 0.5) for slope in (7.6, 8.2, 8.3)]
    z = charge_drift.adapt(charge_drift.EFFECT, problem([1e-3] * 3, recordings=seen)).parameters[2]
    assert z.lower < 0.0
    assert z.upper > 8.3


def test_records_that_were_not_read_leave_the_drift_open():
    assert charge_drift.adapt(charge_drift.EFFECT, problem([1e-3])) is charge_drift.EFFECT
