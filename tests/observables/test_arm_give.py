"""How far an arm gives way to a side cut, and the radial depth that is left."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from metro.batch.processed import Processed, read_batch
from metro.effects.library import library, with_declared
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise, missed
from metro.loop.search.search import search
from metro.loop.search.trial import Gates
from metro.observables.arm.give import GivingArm, give_of, giving_arm
from metro.observables.arm.load_tests import largest_loads
from metro.observables.arm.tip_force import Log
from metro.observables.arm.wall import Wall
from metro.observables.cut import conditions as cutting_force
from metro.observables.deformation.model import DeformationModel
from metro.observables.force import observable as force
from metro.observables.force.held_out_give import PER_NEWTON, with_predicted_give
from metro.observables.problem import Refusal
from metro.robot.kinematics import arm_of_cell
from metro.robot.statics import tip_compliance
from metro.stages.ingest import ingest
from virtual_cell.recipes import kr160

ROOT = Path(__file__).parents[2]
GATES = Gates(model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)
SIDE = ("r01", "r02")  # down, up


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """Side cuts of a robot a little softer in the cut than in its load tests, and how to read them."""
    root = tmp_path_factory.mktemp("kr160")
    with pytest.MonkeyPatch.context() as patch:
        slightly = replace(kr160.ARM, stiffness=0.85 * kr160.ARM.stiffness)
        patch.setattr(kr160, "SOFT", slightly)  # the bundled batch has a much softer one
        kr160.make(root / "kr160-side")
    out = root / "out"
    ingest(root / "kr160-side", ROOT / "config" / "cells", out, {}, "test")
    return read_batch(out), Processed(out)


def test_the_give_is_the_compliance_of_the_tip_along_the_wall_normal(cell):
    arm = arm_of_cell(cell[0].cell, cell[0].manifest)
    softness = np.array([5e-7, 4e-7, 7e-7, 3e-6, 2e-6, 4e-6])
    q, newton = np.radians([[-20.3, -13.9, -4.4, -61.7, 34.9, 56.7]]), np.array([30.0, -110.0, 45.0])
    normal = np.array([0.0, 1.0, 0.0])
    known = GivingArm(DeformationModel(arm), pd.DataFrame(), softness, DeformationModel(arm))
    log, face = Log(q, q, 0 * q, arm.tip(q)), Wall(np.array([1.0, 0, 0]), normal, 0.0, 0.1, 0.0)
    expected = normal @ tip_compliance(arm, q[0], softness) @ newton
    assert known.give(log, face, newton) == pytest.approx(expected, rel=1e-9)
    slot = Wall(face.along, 0 * normal, 0.0, 0.1, 0.0)  # has two walls
    assert known.give(log, slot, newton) == 0.0
    assert known.give(Refusal("no log"), face, newton) == 0.0


@pytest.mark.parametrize(("joint", "newton"), [(1, 1.0), (1, 300.0), (3, 40.0), (5, 1e4)])
def test_the_give_is_as_unsure_as_gears_are_that_a_cut_turns_less_far_than_a_load_test(cell, joint, newton):
    """One elastic joint: its twist within 5 %, and 4 % of the largest one, passed by a tanh."""
    known = giving_arm(*cell)
    arm, softness = known.tested.arm, np.zeros(6)
    softness[joint] = 2e-6
    q, normal = np.radians([-20.3, -13.9, -4.4, -61.7, 34.9, 56.7]), np.array([0.6, 0.8, 0.0])
    step = 1e-6 * np.eye(6)[joint]
    turned = (arm.tip((q + step)[None]) - arm.tip((q - step)[None]))[0] / 2e-6
    force = newton * np.array([0.2, -0.9, 0.4])
    twist = 2e-6 * abs(turned @ force)
    most = 2e-6 * largest_loads(known.tested, known.loads)[joint]
    passed = most * math.tanh(twist / (0.2 * most))
    expected = abs(normal @ turned) * math.hypot(0.05 * twist, 0.04 * (passed - twist))
    one = replace(known, compliance=softness)
    log, face = Log(q[None], q[None], 0 * q[None], arm.tip(q[None])), Wall(normal, normal, 0.0, 0.1, 0.0)
    assert one.give_sd(log, face, force) == pytest.approx(expected, rel=1e-6)
    without = replace(one, loads=known.loads.iloc[:0])
    assert without.give_sd(log, face, force) == pytest.approx(abs(normal @ turned) * 0.05 * twist, rel=1e-6)
    assert one.give_sd(log, replace(face, normal=0 * normal), force) == 0.0
    assert one.give_sd(Refusal("no log"), face, force) == 0.0


def test_what_the_joints_may_be_softer_adds_up(cell):
    known = giving_arm(*cell)
    arm = known.tested.arm
    q = np.radians([[-20.3, -13.9, -4.4, -61.7, 34.9, 56.7]])
    log, face = (
        Log(q, q, 0 * q, arm.tip(q)),
        Wall(np.array([1.0, 0, 0]), np.array([0, 1.0, 0]), 0.0, 0.1, 0.0),
    )
    force = np.array([30.0, -110.0, 45.0])
    each = [replace(known, compliance=known.compliance * one).give_sd(log, face, force) for one in np.eye(6)]
    assert known.give_sd(log, face, force) == pytest.approx(sum(each))
    assert min(each) >= 0.0
    assert 0.04 < sum(each) / abs(known.give(log, face, force)) < 0.3


def test_a_tip_that_was_declared_wrong_gives_way_as_the_load_tests_measured(cell):
    """The load tests and the cut are of one tip, wherever the cell file puts it."""
    batch, read = cell
    wrong = dict(batch.manifest)
    x, y, z = wrong["tool_in_flange_mm"]
    wrong["tool_in_flange_mm"] = [-z, x, y]  # the row of another tool, as long, that points elsewhere
    declared = replace(batch, manifest=wrong)
    for run in SIDE:
        true, found = (
            give_of(each, run, read, giving_arm(each, read), np.ones(3)).per_newton
            for each in (batch, declared)
        )
        assert np.abs(found - true).max() < 0.1 * np.abs(true).max()


def test_a_machine_that_is_no_arm_gives_nothing(cell):
    give = give_of(cell[0], "r01", cell[1], Refusal("no arm.dh"), np.ones(3))
    assert not give.per_newton.any()
    assert give.sd == 0.0


def test_the_give_of_a_held_out_run_is_predicted_and_nothing_of_its_force_is_read(cell):
    batch, read = cell
    observed, tool = force.observe(batch, read, {}), cutting_force.cutter(batch)
    spindle = observed["spindle"].set_index("run")
    held = [run for run in spindle.index if batch.runs.loc[run, "role"] == "validate"]
    found = with_predicted_give(batch, observed["spindle"], tool).set_index("run")["give_mm"]
    giving = [run for run in held if spindle.loc[run, "give_mm"] > 0.01]
    assert giving
    np.testing.assert_allclose(found[giving], spindle.loc[giving, "give_mm"], rtol=0.1)  # a few per cent off
    assert (found.drop(held) == spindle["give_mm"].drop(held)).all()
    wrong = spindle.copy()
    wrong.loc[giving, [c for c in wrong.columns if c.startswith(("mean_", "give_mm"))]] = 7e3
    wrong[PER_NEWTON] = spindle[PER_NEWTON]
    again = with_predicted_give(batch, wrong.reset_index(), tool).set_index("run")["give_mm"]
    np.testing.assert_array_equal(again, found)


@pytest.mark.parametrize("run", SIDE)
def test_a_wall_that_stands_proud_lowers_the_radial_depth_by_as_much(cell, run):
    radius, nominal = 8e-3, 4e-3
    for give in (0.0, 0.15e-3, -0.1e-3):
        cut = cutting_force.cut(cell[0], run, radius, give).engagement
        depth = radius * (1.0 - math.cos(cut.exit - cut.entry))  # of an arc that ends at the wall
        assert depth == pytest.approx(nominal - give, rel=1e-9)
    least = cutting_force.cut(cell[0], run, radius, 1.0).engagement
    assert radius * (1.0 - math.cos(least.exit - least.entry)) == pytest.approx(0.1 * nominal)


def _missed(fitted, axis):
    """Rms of what a fit misses of the forces along an axis, over their rms."""
    square, power = (
        sum(float(of(block)[block.axis == axis].sum()) for block in fitted.blocks)
        for of in (lambda one: missed(one, fitted.noise), lambda one: one.measured**2)
    )
    return math.sqrt(square / power)


def test_the_forces_of_an_arm_that_gives_way_leave_no_misfit(cell):
    batch, read = cell
    observed = force.observe(batch, read, {})

    def misfit(spindle):
        posed = force.problem(batch, observed | {"spindle": spindle}, {})
        task = with_declared(posed, batch.manifest["known"])
        blocks = task.role("identify")
        fitted = fit(Candidate(task.base), blocks, first_noise(0.007, task.scatter, blocks))
        return max(_missed(fitted, axis) for axis in "xyz")

    spindle = observed["spindle"]
    assert (spindle["give_mm"] > 0).sum() >= 3
    assert spindle["give_mm"].max() < 0.3
    with_give, without = misfit(spindle), misfit(spindle.assign(give_mm=0.0))
    assert with_give < 0.0005
    assert without > 0.002


def test_an_arm_of_unknown_stiffness_is_said_to_be_one(cell):
    batch, read = cell
    observed = force.observe(batch, read, {})
    assert any("less what the arm gives way" in note for note in force.problem(batch, observed, {}).notes)
    stiff = observed | {"spindle": observed["spindle"].assign(give_mm=0.0)}
    assert any(
        "deflection of the arm in side cuts is not known" in note
        for note in force.problem(batch, stiff, {}).notes
    )
    machine = replace(batch, cell={"cell": "mill"})
    assert not any("arm" in note for note in force.problem(machine, stiff, {}).notes)


def test_nothing_is_added_to_the_forces_of_an_arm_that_gives_way(cell):
    batch, read = cell
    task = force.problem(batch, force.observe(batch, read, {}), {})
    assert search(with_declared(task, batch.manifest["known"]), library("force"), GATES).names == ()
