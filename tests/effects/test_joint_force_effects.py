"""Effects of the joint force: each put into the logs of the bundled robot batch by formulas of the test."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from metro.batch.processed import Processed, read_batch
from metro.effects import clock_offset
from metro.effects.effect import fitted_to
from metro.effects.library import library
from metro.effects.tool_offset_error import EFFECT
from metro.joint_columns import Axes
from metro.loop.checks.evidence import leave_out
from metro.loop.fitting.held_out import identified_fit
from metro.loop.search.search import search
from metro.loop.search.trial import Gates
from metro.loop.verdict.verdict import estimates
from metro.observables.arm.tip_force import FORCE
from metro.observables.joint_force import observable as joint_force
from metro.robot.kinematics import arm_of_cell, forward
from metro.robot.statics import driven_jacobian, joint_torque
from metro.slips.joints import joint_slips
from metro.stages.identify import base_fit
from metro.stages.ingest import ingest

ROOT = Path(__file__).parents[2]
AXES = Axes((False,) * 6)
GATES = Gates(model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """The bundled batch of the robot's side cuts, and what was observed of its joints."""
    out = tmp_path_factory.mktemp("kr160") / "out"
    ingest(ROOT / "data" / "raw" / "kr160-side", ROOT / "config" / "cells", out, {}, "test")
    batch = read_batch(out)
    return batch, joint_force.observe(batch, Processed(out), {})


def found(cell, torque=None, *, force=None, manifest=None):
    """Search with other torques, force or manifest; name and values of the one effect found."""
    batch, observed = cell
    batch = replace(batch, manifest=manifest or batch.manifest)
    observed = observed | {
        "joint_torque": observed["joint_torque"] if torque is None else torque,
        "tool_force": observed["tool_force"] if force is None else force,
    }
    outcome = search(joint_force.problem(batch, observed, {}), library("joint_force"), GATES)
    assert not outcome.rivals
    assert not any(line.significant for line in outcome.lines)
    return [
        (effect.name, dict(effect.where), effect.values(outcome.final.theta[place]))
        for effect, place in outcome.final.candidate.parts(outcome.final.theta)
    ]


def torques(cell, joint, extra):
    """The torques of a joint (1 … 6) with something added, by the table's rows."""
    table = cell[1]["joint_torque"].copy()
    table[AXES.torques[joint - 1]] += extra(table)
    return table


def turning(table, joint):
    """Direction of a joint, softened where it turns round."""
    return np.tanh(np.radians(table[AXES.rates[joint - 1]].to_numpy()) / 2e-4)


def test_nothing_is_found_where_nothing_is_hidden(cell):
    assert found(cell) == []


def test_the_gains_of_joints_and_of_axes_each_add_up_to_that_of_all(cell):
    task = joint_force.problem(*cell, {})
    block = task.role("identify")[0]
    design = task.base.design(block, np.zeros(0))[0]
    whole, joints, axes, _ = np.split(design, [1, 7, 10], axis=1)
    np.testing.assert_allclose(joints.sum(axis=1), whole[:, 0], atol=1e-9)
    np.testing.assert_allclose(axes.sum(axis=1), whole[:, 0], atol=1e-9)
    for i, axis in enumerate(np.eye(3)):
        record = replace(block.setting.force, integral=block.setting.force.integral * axis)
        alone = replace(block, setting=replace(block.setting, force=record))
        np.testing.assert_allclose(task.base.design(alone, np.zeros(0))[0][:, 0], axes[:, i], atol=1e-9)
        of_joint = np.asarray(block.axis) == f"joint {i + 1}"
        assert not joints[~of_joint, i].any()


def test_crosstalk_is_the_force_along_one_axis_seen_in_another(cell):
    task = joint_force.problem(*cell, {})
    block = task.role("identify")[0]
    names = [parameter.name for parameter in task.base.parameters]
    design = task.base.design(block, np.zeros(0))[0]
    integral = block.setting.force.integral
    for name in (name for name in names if name.startswith("crosstalk")):
        along, seen = "xyz".index(name[13]), "xyz".index(name[-1])
        record = np.zeros_like(integral)
        record[:, seen] = integral[:, along]
        alone = replace(
            block, setting=replace(block.setting, force=replace(block.setting.force, integral=record))
        )
        np.testing.assert_allclose(
            task.base.design(alone, np.zeros(0))[0][:, 0], design[:, names.index(name)], atol=1e-9
        )


@pytest.mark.parametrize(("axis", "other", "turn"), [(0, 2, 0.018), (1, 2, -0.015), (0, 1, 0.02)])
def test_a_dynamometer_that_is_turned_by_a_degree_is_no_tool_elsewhere(cell, axis, other, turn):
    force = cell[1]["tool_force"].copy()
    seen = force[FORCE].to_numpy()
    turned = seen.copy()
    turned[:, axis] += turn * seen[:, other]
    turned[:, other] -= turn * seen[:, axis]
    force[FORCE] = turned
    assert found(cell, force=force) == []


@pytest.mark.parametrize("change", [-0.012, 0.012])
def test_motors_that_are_warmer_in_the_cut_hang_no_mass_on_the_flange(cell, change):
    """A torque constant that has changed since the idle run shows in the torque of the weight, too."""
    table = cell[1]["joint_torque"].copy()
    idle = [f"idle{joint}_nm" for joint in range(1, 7)]
    table[AXES.torques] += change * (table[idle].to_numpy() + table[AXES.torques].to_numpy())
    assert found(cell, table) == []


def elsewhere(cell, offset=(0.0, 0.12, 0.0)):
    """The torques of a tool whose tip is 120 mm, or an ``offset`` in m, from where it was declared to be."""
    model = joint_force.problem(*cell, {}).base
    away = replace(model, arm=model.arm.with_tip_moved(np.array(offset)))
    torque = cell[1]["joint_torque"].copy()
    forces = dict(tuple(cell[1]["tool_force"].groupby("run")))
    for run, rows in torque.groupby("run"):
        setting = joint_force.torque_run(rows, forces[run])
        mean = setting.force.mean(setting.t, setting.width)
        more = [joint_torque(driven_jacobian(each.arm, setting.q), mean) for each in (away, model)]
        torque.loc[rows.index, AXES.torques] += more[0] - more[1]
    return torque


@pytest.mark.slow
def test_a_tool_that_is_far_elsewhere_is_still_named(cell):
    ((name, _, values),) = found(cell, elsewhere(cell))
    assert name == "tool_offset_error"
    assert values["dy_mm"] == pytest.approx(120.0, abs=30.0)


# The row of another tool: as long as the one that was declared, but it points elsewhere.
ELSEWHERE = [(-0.35, 0.08, 0.1), (-0.36, -0.04, 0.06)]


@pytest.mark.parametrize(
    "offset", [(0.3, 0.13, -0.07), *(pytest.param(at, marks=pytest.mark.slow) for at in ELSEWHERE)]
)
def test_the_row_of_another_tool_is_named_and_no_torque_is_taken_for_another_joints(cell, offset):
    torque = elsewhere(cell, offset)
    assert joint_slips(joint_force.problem(cell[0], cell[1] | {"joint_torque": torque}, {})) == ()
    ((name, _, values),) = found(cell, torque)
    assert name == "tool_offset_error"
    found_at = [values[f"d{axis}_mm"] for axis in "xyz"]
    np.testing.assert_allclose(found_at, 1e3 * np.array(offset), atol=60.0)


@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (-0.35, 0.08, 0.1), (-0.5, 0.1, -0.5)])
def test_the_search_for_a_tip_starts_where_the_torques_of_the_fitted_runs_put_it(cell, offset):
    """From the declared tip it had ended at the bounds: gains had made up for another one."""
    torque = elsewhere(cell, offset)

    def start(table):
        task = joint_force.problem(cell[0], cell[1] | {"joint_torque": table}, {})
        (effect,), _ = fitted_to((EFFECT,), task)
        return [at for parameter in effect.parameters for at in parameter.starts]

    np.testing.assert_allclose(start(torque), 1e3 * np.array(offset), atol=20.0)
    held_out = torque["run"].map(cell[0].runs["role"]) == "validate"
    assert held_out.any()
    spoiled = torque.copy()
    spoiled.loc[held_out, AXES.torques] *= 3.0
    assert start(spoiled) == start(torque)


def test_torques_of_other_joints_stay_a_mistake_where_the_tip_could_be_elsewhere(cell):
    """No tip makes of the torques of two joints each other's, although it explains more than the declared."""
    torque = cell[1]["joint_torque"].copy()
    torque[AXES.torques[2]], torque[AXES.torques[4]] = torque[AXES.torques[4]], torque[AXES.torques[2]].copy()
    (slip,) = joint_slips(joint_force.problem(cell[0], cell[1] | {"joint_torque": torque}, {}))
    assert "tau3_nm holds the torque of joint 5" in slip.text


def test_the_strain_that_an_effect_takes_from_the_instruments_counts_for_it(cell):
    task = joint_force.problem(cell[0], cell[1] | {"joint_torque": elsewhere(cell)}, {})
    outcome = search(task, library("joint_force"), GATES)
    without, with_it = (leave_out(each, outcome.prior) for each in (outcome.base, outcome.final))
    assert with_it["instruments"] > without["instruments"] + 1.0


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_instruments_that_are_off_as_stated_are_no_effect_and_their_gains_are_told(cell, seed):
    rng = np.random.default_rng(seed)
    joints, axes = rng.normal(0.0, joint_force.DRIVEN, 6), rng.normal(0.0, joint_force.CALIBRATED, 3)
    torque, force = cell[1]["joint_torque"].copy(), cell[1]["tool_force"].copy()
    torque[AXES.torques] *= 1.0 + joints
    force[FORCE] *= 1.0 + axes
    assert found(cell, torque, force=force) == []
    observed = cell[1] | {"joint_torque": torque, "tool_force": force}
    task = joint_force.problem(cell[0], observed, {})
    told = identified_fit(task, base_fit(task, 0.007))
    # What joints and axes share is one factor: only how they differ from each other can be told.
    apart = told.beta[1:7] - told.beta[1:7].mean() - (joints - joints.mean())
    sd = np.sqrt(np.diag(told.covariance))[1:7]
    assert (np.abs(apart) < 3.0 * sd).all()
    assert (sd < 1.05 * joint_force.DRIVEN).all()
    assert sd.min() < 0.75 * joint_force.DRIVEN  # else the runs told nothing


# Joint 2 keeps its direction, so that no idle run shows its friction: of one that holds 2000 N m some 10 N m
# are within what warmth does.
@pytest.mark.parametrize(("joint", "size"), [pytest.param(2, 60.0, marks=pytest.mark.slow), (6, -10.0)])
def test_friction_that_differs_from_the_idle_run_is_found_in_its_joint(cell, joint, size):
    ((name, where, values),) = found(cell, torques(cell, joint, lambda t: size * turning(t, joint)))
    assert (name, where) == ("friction_reversal", {"joint": joint})
    assert values["torque_nm"] == pytest.approx(size, abs=1.2)


@pytest.mark.slow
def test_friction_that_grows_along_the_log_is_found_with_its_slope(cell):
    ((name, where, values),) = found(cell, torques(cell, 3, lambda t: 1.5 * t["since_s"] * turning(t, 3)))
    assert (name, where) == ("friction_warmup", {"joint": 3})
    assert values["slope_nm_s"] == pytest.approx(1.5, abs=0.2)


def test_a_gear_that_ripples_is_found_with_its_order(cell):
    ((name, where, values),) = found(
        cell, torques(cell, 1, lambda t: 6.0 * np.sin(800.0 * np.radians(t[AXES.positions[0]]) + 1.0))
    )
    assert (name, where) == ("gear_ripple", {"joint": 1})
    assert values["order"] == pytest.approx(800.0, abs=5.0)
    assert values["torque_nm"] == pytest.approx(6.0, rel=0.15)


@pytest.mark.parametrize("late_s", [-0.641, 1.4])
def test_a_clock_is_sought_where_torques_rise_with_the_force_however_far_it_is(cell, late_s):
    force = cell[1]["tool_force"].copy()
    force["t_s"] -= late_s
    task = joint_force.problem(cell[0], cell[1] | {"tool_force": force}, {})
    assert joint_slips(task) == ()
    ((effect,), _) = fitted_to((clock_offset.EFFECT,), task)
    assert min(abs(start - 1e3 * late_s) for start in effect.parameters[0].starts) < 20.0


def test_a_clock_that_is_late_is_found_to_a_few_milliseconds(cell):
    force = cell[1]["tool_force"].copy()
    force["t_s"] -= 0.2  # the log stamps everything 0.2 s later than the dynamometer
    ((name, _, values),) = found(cell, force=force)
    assert name == "clock_offset"
    assert values["offset_ms"] == pytest.approx(200.0, abs=4.0)


@pytest.mark.slow
def test_a_weight_on_the_flange_is_found_with_its_place(cell):
    batch, observed = cell
    arm, table = arm_of_cell(batch.cell, batch.manifest), observed["joint_torque"].copy()
    q, centre, step = np.radians(table[AXES.positions].to_numpy()), np.array([0.1, 0.05, 0.2]), 1e-6

    def energy(angles):  # potential: its slope by an angle is the torque that holds the weight
        flange = forward(arm.dh, angles)
        return 4.0 * 9.81 * (flange[..., :3, :3] @ centre + flange[..., :3, 3])[..., 2]

    for joint in range(6):
        move = step * np.eye(6)[joint]
        table[AXES.torques[joint]] += (energy(q + move) - energy(q - move)) / (2.0 * step)
    ((name, _, values),) = found(cell, table)
    assert name == "payload_error"
    assert values["mass_kg"] == pytest.approx(4.0, abs=0.3)
    assert values["com_mm"][1:] == pytest.approx([50.0, 200.0], abs=60.0)


@pytest.mark.slow
def test_a_tip_that_is_not_where_it_was_declared_is_found(cell):
    declared = dict(cell[0].manifest)
    x, y, z = declared["tool_in_flange_mm"]
    declared["tool_in_flange_mm"] = [x, y - 120.0, z]  # the true tip lies 120 mm further along y
    task = joint_force.problem(replace(cell[0], manifest=declared), cell[1], {})
    outcome = search(task, library("joint_force"), GATES)
    assert outcome.names == ("tool_offset_error",)
    told = {one["parameter"]: one for one in estimates(outcome.final, "tool_offset_error")}
    assert abs(told["dy_mm"]["value"] - 120.0) < 3.0 * told["dy_mm"]["sd"]
    assert told["dy_mm"]["sd"] < 12.0


def speeds(table, joint):
    """Speed of a joint, rad/s."""
    return np.radians(table[AXES.rates[joint - 1]].to_numpy())


def test_a_joint_with_stiffer_grease_is_taken_for_no_effect_of_the_library(cell):
    batch, observed = cell
    observed = observed | {"joint_torque": torques(cell, 3, lambda t: 2000.0 * speeds(t, 3))}
    outcome = search(joint_force.problem(batch, observed, {}), library("joint_force"), GATES)
    assert outcome.names == ()
    (likeness,) = outcome.likeness.candidate.effects
    assert (likeness.name, likeness.where) == ("friction_by_speed", {"joint": 3})
    assert outcome.likeness.theta == pytest.approx([2000.0], rel=0.15)
