"""The tool's end as a candidate effect."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.force import Cut
from metro.cutting.law import EdgeLaw
from metro.effects import tool_end
from metro.observables.force.dynamometer import Recording
from metro.observables.force.model import ForceModel, ForceSetting, Structure
from metro.observables.problem import Refusal

R = 5e-3
MODEL = ForceModel(Cutter(R, 0.6, evenly_pitched(2)), EdgeLaw())
BETA = np.array([900e6, 300e6, -200e6, 15e3, 20e3, -2e3])
RECORDING = Recording((0.5,), 1.0, 20.0)


def setting(depth):
    return ForceSetting(Cut(0.05e-3, depth, Engagement(0.0, np.pi)), 0.0, 12, RECORDING, 0.0)


def problem(depths, model=MODEL):
    blocks = tuple(
        SimpleNamespace(setting=setting(depth), role="identify", zeros=np.zeros((1, 3))) for depth in depths
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
