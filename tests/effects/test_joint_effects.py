"""What one joint does: found where it is hidden, of the right joint; absent where not; confusions named."""

from dataclasses import replace
from types import SimpleNamespace

import elastic_arm
import numpy as np
import pytest
from elastic_arm import ARM

from metro.effects import (
    flange_rotation,
    friction_reversal,
    joint_backlash,
    stiffness_hardening,
    stiffness_scale,
)
from metro.effects.effect import fitted_to
from metro.effects.library import library, with_declared
from metro.loop.search.search import search
from metro.loop.search.trial import Gates
from metro.loop.verdict.verdict import parameters
from metro.observables.deformation.blocks import WallErrors
from metro.observables.deformation.model import DeformationModel
from metro.observables.deformation.proposals import feasible
from metro.observables.deformation.setting import CutWall
from metro.observables.problem import Refusal
from metro.robot.kinematics import Arm

GATES = Gates(model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)
EFFECTS = (
    *(*joint_backlash.EFFECT, *stiffness_hardening.EFFECT),
    *(*stiffness_scale.EFFECT[2:], *friction_reversal.EFFECT),
)
WAYS = tuple((pose, degrees, "down" if pose else "up") for pose in (0, 2) for degrees in (0, 90))


def found(truth, seed=1, effects=EFFECTS, **made):
    return search(elastic_arm.problem(truth, seed, **({"ways": WAYS} | made)), effects, GATES)


@pytest.mark.parametrize(
    ("truth", "name", "joint", "parameter", "value"),
    [
        ({"gap": {5: 12.0}}, "joint_backlash", 5, "angle_mdeg", 12.0),
        ({"factor": {1: 0.6}}, "stiffness_scale", 1, "factor", 0.6),
        ({"friction": {5: 40.0}}, "friction_reversal", 5, "torque_nm", 40.0),
        ({"cubic": {4: 1.5e12}}, "stiffness_hardening", 4, "cubic", 1.5e12),
        ({"factor": dict.fromkeys(range(1, 7), 0.8)}, "stiffness_scale", "all", "factor", 0.8),
    ],
)
def test_what_a_joint_hides_is_found_in_cuts_that_part_the_joints(truth, name, joint, parameter, value):
    own = tuple(effect for effect in EFFECTS if effect.name in {name, "stiffness_scale"})
    outcome = found(truth, effects=own)
    assert outcome.names == (name,)
    told = parameters(outcome.final, name)
    assert told["joint"] == joint
    low, high = told[parameter]["ci95"]
    assert low < value < high
    assert told[parameter]["value"] == pytest.approx(value, rel=0.15)


def test_a_gap_that_small_torques_do_not_pass_is_one_and_no_soft_spring():
    truth = {"gap": {5: 12.0}, "drag": {5: 12.0}}
    effects = (*joint_backlash.EFFECT, *stiffness_scale.EFFECT)
    outcome = found(truth, effects=effects, ways=elastic_arm.EVERY_WAY, sizes=(0.2, 0.5, 1.3))
    assert outcome.names == ("joint_backlash",)
    told = parameters(outcome.final, "joint_backlash")
    assert told["joint"] == 5
    assert told["angle_mdeg"]["ci95"][0] < 12.0 < told["angle_mdeg"]["ci95"][1]
    assert 4.0 < told["drag_nm"]["value"] < 25.0


def test_nothing_is_found_where_the_joints_are_linear_springs():
    assert found({}).names == ()


def test_joints_that_cuts_load_alike_are_not_told_apart_and_the_next_cuts_would():
    """One pose, one direction: every joint's gap is the same offset of the wall."""
    task = elastic_arm.problem({"gap": {1: 8.0}}, 3, ways=elastic_arm.ONE_WAY, sizes=(0.4, 0.8, 1.2, 1.6))
    outcome = search(task, joint_backlash.EFFECT, GATES)
    assert outcome.names == ("joint_backlash",)
    named = {name for rival in outcome.rivals for name in rival.pair}
    assert "joint_backlash (joint 1)" in named
    assert len(outcome.rivals) >= 2


def test_proposed_walls_part_joints_that_the_cuts_do_not():
    from metro.loop.planning.experiment import prospects

    task = elastic_arm.problem({"gap": {1: 8.0}}, 3, ways=elastic_arm.ONE_WAY, sizes=(0.4, 0.8, 1.2, 1.6))
    softness = 1 / elastic_arm.STIFFNESS

    def per_newton(setting):
        return DeformationModel(ARM).per_newton(setting, softness)

    walls = [block for block in task.blocks if isinstance(block.setting, CutWall)]
    error = WallErrors(per_newton, DeformationModel(ARM).per_radian, lack_of_fit=0.0)
    proposals = feasible(walls, task.role("calibrate"), ARM, error)
    outcome = search(task, joint_backlash.EFFECT, GATES)
    best = prospects(outcome.final, outcome.rivals[0].fit, proposals)[0]
    assert best.decides
    assert "feed at 90°" in best.proposal.words or "the pose of load tests" in best.proposal.words


def test_the_deflection_of_hardened_joints_is_that_of_brute_force():
    truth = {"cubic": {4: 8e11, 5: 3e11}, "gap": {2: 6.0}, "factor": {3: 0.7}}
    model = DeformationModel(ARM)
    torsion = model.torsion.with_joint(3, cubic=8e11).with_joint(4, cubic=3e11)
    torsion = torsion.with_joint(1, gap=np.radians(6e-3)).with_joint(2, factor=0.7)
    bent = replace(model, torsion=torsion)
    task = elastic_arm.problem(truth, 0, ways=WAYS[:2])
    beta = 1 / elastic_arm.STIFFNESS
    for block in task.blocks:
        matrix, offset = bent.design(block, np.zeros(0), beta)
        if isinstance(block.setting, CutWall):
            setting = block.setting
            expected = [
                setting.normal @ elastic_arm.deflection(ARM, q, f, truth, cutting=True)
                for q, f in zip(setting.commanded, setting.force, strict=True)
            ]
            np.testing.assert_allclose(offset + matrix @ beta, np.array(expected)[setting.kept], rtol=1e-3)
        else:
            expected = [
                elastic_arm.deflection(ARM, q, f, truth, cutting=False)
                for q, f in zip(block.setting.joints, block.setting.force, strict=True)
            ]
            np.testing.assert_allclose(offset + matrix @ beta, np.ravel(expected), atol=1e-9)
        step = 1e-4 * beta * np.eye(6)[3]
        above, below = (
            sum((matrix @ b, offset))
            for b in (beta + step, beta - step)
            for matrix, offset in [bent.design(block, np.zeros(0), b)]
        )
        np.testing.assert_allclose((above - below) / (2 * step[3]), matrix[:, 3], rtol=1e-4, atol=1e-3)


def test_a_tip_that_is_declared_wrong_loads_the_joints_and_moves_as_the_true_one():
    truth = {"offset": (8.0, -5.0, 12.0)}
    task = elastic_arm.problem(truth, 0, ways=WAYS[:2])
    true = DeformationModel(Arm(ARM.dh, ARM.tool + np.array([8e-3, -5e-3, 12e-3]), ARM.work))
    beta = 1 / elastic_arm.STIFFNESS

    def missed(model, block):
        matrix, offset = model.design(block, np.zeros(0), beta)
        return np.sqrt(np.mean((offset + matrix @ beta - block.measured) ** 2))

    for block in task.role("calibrate"):
        assert missed(true, block) < 6e-6
        assert missed(DeformationModel(ARM), block) > 8e-6


def test_hardening_is_started_at_the_twist_of_the_batch_and_a_joint_that_nothing_twists_is_refused():
    task = elastic_arm.problem({}, 0, ways=WAYS[:2])
    able, _ = fitted_to(stiffness_hardening.EFFECT, task)
    assert [effect.where["joint"] for effect in able] == [1, 2, 3, 4, 5, 6]
    compliance, twist = task.base.largest_twists(task.blocks)
    np.testing.assert_allclose(1 / compliance, elastic_arm.STIFFNESS, rtol=0.1)
    (parameter,) = able[3].parameters
    assert parameter.starts[1] * twist[3] ** 2 * compliance[3] == pytest.approx(0.5)
    no_lever = DeformationModel(Arm(ARM.dh, np.zeros(3), ARM.work))
    _, unable = fitted_to(stiffness_hardening.EFFECT[5:], replace(task, base=no_lever))
    assert "joint 6" in unable["stiffness_hardening"]


def test_effects_of_joints_are_refused_where_the_model_has_none():
    printed = SimpleNamespace(base=SimpleNamespace(structure=None), blocks=())
    _, unable = fitted_to((*EFFECTS, flange_rotation.EFFECT), printed)
    joints = {"joint_backlash", "stiffness_hardening", "flange_rotation", "friction_reversal"}
    assert set(unable) == joints
    able, _ = fitted_to(EFFECTS, printed)
    assert [effect.form for effect in able] == ["all joints"]


def test_a_model_with_the_rotation_of_the_flange_has_nothing_to_gain_from_it():
    refused = flange_rotation.EFFECT.adapt(flange_rotation.EFFECT, elastic_arm.problem({}, 0, ways=WAYS[:1]))
    assert isinstance(refused, Refusal)
    assert refused.reason == ""


def test_a_model_without_the_rotation_of_the_flange_is_told_of_it_by_cuts_and_loads():
    base = DeformationModel(ARM, flange_rotation=0.0)
    outcome = found({}, effects=(flange_rotation.EFFECT, *stiffness_scale.EFFECT[2:]), base=base)
    assert outcome.names == ("flange_rotation",)
    share = parameters(outcome.final, "flange_rotation")["share"]
    assert share["ci95"][0] < 1.0 < share["ci95"][1]


def test_the_manifest_may_declare_what_a_joint_does():
    task = elastic_arm.problem({}, 0, ways=WAYS[:1])
    told = with_declared(task, {"joint_backlash": {"joint": 3, "angle_mdeg": 4.0}})
    assert told.base.torsion.gap[2] == pytest.approx(np.radians(4e-3))
    every = with_declared(task, {"stiffness_scale": {"joint": "all", "factor": 0.9}})
    assert every.base.structure.stiffness_factor == pytest.approx(0.9)
    one = with_declared(task, {"stiffness_scale": {"joint": 2, "factor": 0.9}})
    assert one.base.torsion.factor[1] == pytest.approx(0.9)


def test_flatness_has_one_factor_for_the_whole_machine():
    forms = [effect for effect in library("flatness") if effect.name == "stiffness_scale"]
    assert [(effect.form, dict(effect.where)) for effect in forms] == [("", {})]
