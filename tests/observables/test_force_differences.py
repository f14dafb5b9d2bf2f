"""Differences between predictions of a force that share work: against each prediction by itself."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.force import Cut
from metro.cutting.helical import Helix
from metro.cutting.law import EdgeLaw
from metro.effects.amplifier_filter import LowPass
from metro.observables.force import order_basis as basis_room
from metro.observables.force.dynamometer import Recording, Resonance
from metro.observables.force.model import ForceModel, ForceSetting, Structure
from metro.observables.force.terms import Bend, Push
from metro.observables.problem import moved_from, predictions

MM, MPA = 1e-3, 1e6
TOOL = Cutter(5 * MM, 0.6, evenly_pitched(2))
CUT = Cut(0.05 * MM, 2 * MM, Engagement(0.0, np.pi))
BETA = np.array([800 * MPA, 300 * MPA, 200 * MPA, 20e3, 15e3, 5e3])
PLACES = np.array([[0.7], [0.7001]])


def block_of(setting):
    rows = len(setting.recording.middles) * 3 * (2 * setting.highest + 1)
    rng = np.random.default_rng(0)
    count = len(setting.recording.middles)
    return SimpleNamespace(
        setting=setting, zeros=rng.normal(size=(rows, 3)), measured=np.zeros(rows), repeats=count
    )


def others(model):
    sensor = replace(model.sensor, resonances=(Resonance((900.0,) * 3, (0.05,) * 3),))
    return [
        model,
        replace(model, cutter=replace(TOOL, runout_radius=8e-6, runout_angle=0.3)),
        replace(model, sensor=sensor),
        replace(model, sensor=replace(model.sensor, slope=(1.0, 2.0, -1.0))),
        replace(model, sensor=sensor, cutter=replace(TOOL, helix=0.5)),
        replace(model, structure=replace(model.structure, orbit_amplitude=0.1, orbit_phase=1.0)),
        replace(model, law=EdgeLaw(size_exponent=0.2)),
        model.with_term(LowPass(700.0, 2.5)),
        model.with_term(Push("x", (), 3.0)),
        model.with_term(Bend("y", 1.0, 50.0, 0.2)),
    ]


@pytest.mark.parametrize("compliance", [(0.0, 0.0), (2e-7, 5e-8)])
@pytest.mark.parametrize("helix", [None, "hole"])
def test_differences_are_those_of_predictions(compliance, helix):
    recording = Recording((0.2, 0.6), 0.4, 80.0, *((6.0,) if helix else ()))
    setting = ForceSetting(CUT, 0.3, 16, recording, 0.0, Helix(20 * MM, 1 * MM, 1e-5) if helix else None)
    places = np.column_stack([PLACES, [[0.4], [0.4]]]) if helix else PLACES
    block = block_of(setting)
    model = ForceModel(TOOL, EdgeLaw(), structure=Structure(compliance=compliance))
    moved, own = model.differences(others(model), block, places, BETA)
    here = predictions(moved_from(model, model), block, places, BETA)
    for found, other in zip(moved, others(model), strict=True):
        expected = predictions(moved_from(other, model), block, places[:1], BETA)[0] - here[0]
        np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(here).max())
    np.testing.assert_allclose(own[0], here[1] - here[0], atol=1e-9 * np.abs(here).max())
    assert not moved[0].any()
    changes = [each.any() for each in moved[1:]]
    assert changes == [True] * 4 + [helix is not None] + [True] * 3 + [helix is None]


def test_a_tool_that_was_asked_whether_it_is_in_balance_is_not_solved_again(monkeypatch):
    solved, solve = [], basis_room.yielding
    monkeypatch.setattr(basis_room, "yielding", lambda *a, **k: solved.append(a) or solve(*a, **k))
    block = block_of(ForceSetting(CUT, 0.3, 16, Recording((0.2,), 0.4, 80.0), 0.0))
    model = ForceModel(TOOL, EdgeLaw(), structure=Structure(compliance=(1.7e-7, 4.3e-8)))
    assert not model.beyond(block, BETA)
    predictions(model, block, PLACES, BETA)
    model.design(block, PLACES[0], BETA)
    assert len(solved) == 1
