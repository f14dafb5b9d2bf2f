"""Deflection of the tool in the force of an independent simulator: beside runout, and where there is none."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from blind import clean

from metro.batch.processed import Processed, read_batch
from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.helical import Helix, ramped
from metro.cutting.helical import turn as turn_about_z
from metro.cutting.law import EdgeLaw
from metro.cutting.yielding_steady import yielding
from metro.effects import tool_runout
from metro.effects.tool_deflection import EFFECT, apply
from metro.loop.checks.evidence import compare
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise
from metro.observables.force import observable as force
from metro.observables.force.dynamometer import Recording
from metro.observables.force.model import ForceModel, ForceSetting, Structure
from metro.signals.orders import advance, to_orders
from metro.stages.ingest import ingest
from virtual_cell.recipes import force as recipe

RUNOUT = {"radius_um": 9.0, "angle_deg": 40.0}
SPRING = {"kx_n_um": 10.0, "ky_n_um": 6.0}
STEEL = np.array([850e6, 330e6, 190e6, 15e3, 18e3, 5e3])


def short_plans(*arguments):
    """Plan few of the recipe's cuts: short ones, two slots and a side cut, with a replicate of each."""
    slots = planned(*arguments)[1:5:2]
    side = planned(*arguments)[4]
    return tuple(replace(plan, full_s=0.2, replicates=2) for plan in (*slots, side))


planned = recipe._plans


@pytest.mark.parametrize("seed", [3, pytest.param(6, marks=pytest.mark.slow)])
def test_the_stiffness_of_a_tool_that_yields_beside_its_runout_is_found(tmp_path, monkeypatch, seed):
    monkeypatch.setattr(recipe, "_plans", short_plans)
    recipe.make(tmp_path / "blind-test", {"tool_runout": RUNOUT, "tool_deflection": SPRING}, seed)
    ingest(tmp_path / "blind-test", tmp_path, tmp_path / "out", {}, "test")
    batch = read_batch(tmp_path / "out")
    observed = force.observe(batch, Processed(tmp_path / "out"), {})
    task = force.problem(batch, observed, {})
    prior = first_noise(0.007, task.scatter, task.blocks)
    fitted = fit(Candidate(task.base), task.blocks, prior)
    for effects in ((tool_runout.EFFECT,), (tool_runout.EFFECT, EFFECT)):
        rigid, fitted = fitted, fit(Candidate(task.base, effects), task.blocks, prior, fitted)
    deviation = np.sqrt(np.diag(fitted.covariance))[-2:]
    assert np.abs(fitted.theta[-2:] - list(SPRING.values())) == pytest.approx(0.0, abs=3.0 * deviation.max())
    assert deviation.max() < 1.5
    assert compare(rigid, fitted).p_value < 1e-5


@pytest.mark.xdist_group("blind-clean")
def test_in_a_batch_without_it_no_deflection_is_found():
    outcome, _, _ = clean(3)
    assert "tool_deflection" not in outcome.names


def test_applying_sets_the_tips_compliance_and_nothing_else():
    model = ForceModel(Cutter(6e-3, 0.5, evenly_pitched(3)), EdgeLaw())
    changed = apply(model, {"kx_n_um": 4.0, "ky_n_um": 8.0})
    assert changed.structure == Structure(compliance=(0.25e-6, 0.125e-6))
    assert (changed.cutter, changed.law, changed.sensor) == (model.cutter, model.law, model.sensor)


def test_a_tool_that_is_too_soft_to_cut_steadily_is_beyond_the_model():
    slot = Cut(70e-6, 1.5e-3, Engagement(0.0, math.pi))
    setting = ForceSetting(slot, 0.0, 8, Recording((0.1,), 0.1, 520.0), 0.0)
    block = SimpleNamespace(setting=setting, zeros=np.zeros((51, 0)))
    tool = Cutter(6e-3, math.radians(35), evenly_pitched(2), 8e-6, 0.7)
    stiff, soft = (
        ForceModel(tool, EdgeLaw(), true_path=False, structure=Structure(compliance=(1 / 40e6, 1 / across)))
        for across in (20e6, 0.4e6)
    )
    assert stiff.beyond(block, STEEL) == ""
    assert "find no balance" in soft.beyond(block, STEEL)
    assert replace(soft, structure=Structure()).beyond(block, STEEL) == ""
    taken = 0.5 ** np.arange(1, 12)  # what a search sees there: the first of these that is in balance
    seen = soft.design(block, np.zeros(1), STEEL)[0]
    first = next(
        model
        for model in (replace(soft, structure=Structure(compliance=(s / 40e6, s / 0.4e6))) for s in taken)
        if not model.beyond(block, STEEL)
    )
    assert np.array_equal(seen, first.design(block, np.zeros(1), STEEL)[0])


@pytest.mark.parametrize("direction", [0.0, math.pi / 2, 0.7])
def test_a_spring_is_the_same_spring_in_a_turned_feed_frame(direction):
    along, across, mixed = Structure(compliance=(3e-7, 1e-7)).seen(direction)
    force_on_tool = np.array([3.0, -2.0])  # work frame
    turn = np.array([[math.cos(direction), math.sin(direction)], [-math.sin(direction), math.cos(direction)]])
    bent = np.array([[along, mixed], [mixed, across]]) @ (turn @ force_on_tool)
    assert turn.T @ bent == pytest.approx(np.array([3e-7, 1e-7]) * force_on_tool)


def test_on_an_orbit_each_time_block_has_the_spring_as_it_stands_to_the_feed():
    cutter, law, orbit = Cutter(6e-3, 0.5, evenly_pitched(2), 8e-6, 0.3), EdgeLaw(), 4e-3
    cut = Cut(70e-6, 1.5e-3, Engagement(0.0, math.pi), 1.0 / orbit)
    recording = Recording(middles=(0.1, 0.4, 0.8, 1.3), span=1e-3, speed=80.0, orbit=2.0)
    setting = ForceSetting(cut, 0.0, 12, recording, 0.0, Helix(orbit, 1e-4, 1e-6))
    block = SimpleNamespace(setting=setting, zeros=np.zeros((4 * 3 * 25, 0)))
    soft = ForceModel(cutter, law, structure=Structure(compliance=(1 / 10e6, 1 / 5e6)))
    phase, start = nuisance = np.array([0.7, 2.0])
    predicted, rigid = (
        (model.design(block, nuisance, STEEL)[0] @ STEEL).reshape(4, 3, 25)
        for model in (soft, replace(soft, structure=Structure()))
    )
    for b, middle in enumerate(recording.middles):
        feed = start + recording.orbit * middle
        c, s = math.cos(feed), math.sin(feed)
        turn = np.array([[c, s], [-s, c]])
        compliance = turn @ np.diag([1 / 10e6, 1 / 5e6]) @ turn.T
        basis = to_orders(yielding(cutter, law, cut, STEEL, compliance, true_path=True).basis, 12)
        expected = (turn_about_z(start) @ ramped(advance(basis, phase), setting.helix.ramp) @ STEEL).T
        change = np.linalg.norm(expected - rigid[b])
        assert np.linalg.norm(predicted[b] - expected) < 0.1 * change
        assert change > 0.02 * np.linalg.norm(expected)
