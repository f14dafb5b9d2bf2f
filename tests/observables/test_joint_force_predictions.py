"""What the joint force model predicts in one step, against its design, and the weight it carries."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from metro.effects.effect import fitted_to
from metro.effects.library import library
from metro.observables.joint_force.model import (
    Instruments,
    JointForceModel,
    TorqueRun,
    driven,
    in_waves,
    rubbing,
    running,
)
from metro.robot.drive_torques import DriveTorques, Ripple, slid
from metro.robot.kinematics import arm_of_cell, forward
from metro.robot.payload import GRAVITY, Payload, gravity_torque
from metro.robot.statics import flange_of
from metro.same import Same

DH = [[0, 90, 500, 250], [90, 0, 0, 610], [-180, -90, 0, 70], [0, 90, 710, 0], [0, -90, 0, 0], [0, 0, 215, 0]]
ARM = arm_of_cell({"arm": {"dh": DH}}, {"tool_in_flange_mm": [210, 0, 280]})
T = np.linspace(0.0, 4.0, 81)
Q = np.array([0.1, -0.4, 0.2, 0.3, 0.8, 0.2]) + 0.2 * np.sin(np.outer(T, [0.5, 0.4, 0.9, 0.3, 1.1, 0.7]))
RUN = TorqueRun(
    Q,
    np.gradient(Q, T, axis=0),
    T,
    T,
    np.full(81, 0.05),
    running(T, 50.0 * np.column_stack([np.sin(3 * T), np.cos(2 * T), T])),
    np.outer(T, np.arange(1.0, 7.0)),
)
DRIVES = DriveTorques(
    reversal=(0.0, 3.0), warmup=(0.0, 0.0, 0.5), viscous=(4.0,), ripple=(Ripple(4, 60.0, 2.0, 1.0),)
)
LADEN = (Payload(5.0, (0.1, 0.05, -0.2)), Payload(-2.0))


@pytest.mark.parametrize("setting", [RUN, Instruments()])
@pytest.mark.parametrize(
    "parts", [{}, {"drives": DRIVES}, {"payload": LADEN}, {"drives": DRIVES, "offset": 0.02}]
)
def test_the_prediction_is_that_of_the_design(setting, parts):
    model = JointForceModel(ARM, **parts)
    beta = np.random.default_rng(1).normal(0.0, 0.05, len(model.parameters))
    block = SimpleNamespace(setting=setting)
    matrix, offset = model.design(block, np.zeros(0), beta)
    found = model.predictions(block, np.zeros((2, 0)), beta)
    np.testing.assert_allclose(found, np.tile(offset + matrix @ beta, (2, 1)), rtol=1e-12, atol=1e-10)


FINE = np.linspace(0.0, 4.0, 1601)  # on a grid as coarse as the path's, a record is straight about each place
CURVED = replace(RUN, force=running(FINE, 50.0 * np.column_stack([np.sin(3 * FINE), np.cos(2 * FINE), FINE])))


@pytest.mark.parametrize("setting", [CURVED, Instruments()])
@pytest.mark.parametrize("late", [0.0, 0.0123])
def test_models_differ_by_what_their_predictions_differ(setting, late):
    beta = np.random.default_rng(2).normal(0.0, 0.05, len(JointForceModel(ARM).parameters))
    beta[-1] = late
    block, model = SimpleNamespace(setting=setting), JointForceModel(ARM, drives=DRIVES)
    others = [
        JointForceModel(ARM),
        replace(model, payload=LADEN),
        replace(model, offset=1e-5),  # within one step of the grid of latenesses
        replace(model, arm=ARM.with_tip_moved(np.array([0.1, -0.05, 0.2]))),
    ]
    predicted = [one.predictions(block, np.zeros((1, 0)), beta)[0] for one in (model, *others)]
    moved, beside = model.differences(others, block, np.zeros((2, 0)), beta)
    np.testing.assert_allclose(moved, np.array(predicted[1:]) - predicted[0], rtol=1e-9, atol=1e-8)
    assert beside.shape == (1, len(predicted[0]))
    same, _ = model.differences([replace(model)], block, np.zeros((1, 0)), beta)
    np.testing.assert_array_equal(same, 0.0)


def test_ripples_are_what_a_model_with_the_ripple_predicts_beyond_the_one_without():
    block, orders, beta = SimpleNamespace(setting=RUN), np.array([7.0, 60.0, 300.0]), np.zeros(36)
    model = JointForceModel(ARM, drives=DRIVES)
    (without,) = model.predictions(block, np.zeros((1, 0)), beta)
    seen = model.ripples(block, 4, orders)
    for order, wave in zip(orders, seen.T, strict=True):
        more = replace(DRIVES, ripple=(*DRIVES.ripple, Ripple(4, order, 3.0, -2.0)))
        (found,) = replace(model, drives=more).predictions(block, np.zeros((1, 0)), beta)
        expected = 3.0 * wave.imag - 2.0 * wave.real
        np.testing.assert_allclose(found - without, expected, rtol=1e-9, atol=1e-9)
        assert np.abs(expected).max() > 0.1


def test_a_design_changes_nothing_that_others_are_given():
    block = SimpleNamespace(setting=RUN)
    beta = np.full(len(JointForceModel(ARM).parameters), 0.1)
    before = JointForceModel(ARM).predictions(block, np.zeros((1, 0)), beta).copy()
    JointForceModel(ARM, drives=DRIVES, payload=LADEN).design(block, np.zeros(0), beta)
    np.testing.assert_array_equal(JointForceModel(ARM).predictions(block, np.zeros((1, 0)), beta), before)


def test_what_holds_a_mass_is_the_slope_of_its_height():
    """Virtual work: the torque of each motor is the rise of the potential energy with its angle."""
    centre, mass, step = np.array([0.1, 0.05, -0.2]), 7.0, 1e-6
    q = Q[::20]

    def energy(angles):
        flange = forward(ARM.dh, angles)
        return mass * GRAVITY * (flange[..., :3, :3] @ centre + flange[..., :3, 3])[..., 2]

    slopes = [(energy(q + step * unit) - energy(q - step * unit)) / (2 * step) for unit in np.eye(6)]
    torque = gravity_torque(flange_of(ARM.dh, q)) @ Payload(mass, tuple(centre)).moments
    np.testing.assert_allclose(torque, np.transpose(slopes), atol=1e-5)


def test_friction_is_that_of_the_joint_along_its_path():
    torque = DRIVES.at(Q, RUN.rate, T)
    np.testing.assert_allclose(torque[:, 1], 3.0 * slid(Q[:, 1], RUN.rate[:, 1], 3e-4), atol=1e-12)
    faster = DriveTorques(reversal=(0.0, 3.0), presliding=(0.0, 0.05)).at(Q, RUN.rate, T)
    np.testing.assert_allclose(faster[:, 1], 3.0 * slid(Q[:, 1], RUN.rate[:, 1], 0.05), atol=1e-12)
    assert np.abs(faster - torque).max() > 0.1


@pytest.mark.parametrize("joint", range(6))
def test_friction_begins_in_the_state_and_follows_over_the_turn_of_its_run(joint):
    """What is left of another state at the start fades as exp(-way / turn), whatever the joint does then."""
    turn, start = np.full(6, np.nan), np.zeros(6)
    turn[joint], start[joint] = 0.05, -0.3
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(Q[:, joint])))])
    fading = in_waves(np.exp(-way / 0.05)[:, None])
    of_joint = slice(81 * joint, 81 * (joint + 1))
    run, other = (replace(RUN, turn=turn, start=start + shift * np.eye(6)[joint]) for shift in (0.0, 0.5))
    shapes = [rubbing(one, tuple(range(6)))[of_joint, joint] for one in (run, other)]
    np.testing.assert_allclose(shapes[1] - shapes[0], 0.5 * fading, atol=1e-10)
    drives = DriveTorques().with_friction(joint, reversal=3.0).with_presliding(joint, 0.05)
    torques = [driven(drives, Same(ARM.dh), one)[of_joint] for one in (run, other)]
    np.testing.assert_allclose(torques[1] - torques[0], 1.5 * fading, atol=1e-10)


def test_a_change_of_friction_is_sought_from_the_turn_that_idle_runs_show():
    base = JointForceModel(ARM, DriveTorques(presliding=(math.nan, 0.5e-3)))
    reversals = tuple(effect for effect in library("joint_force") if effect.name == "friction_reversal")
    effects, _ = fitted_to(reversals, SimpleNamespace(base=base))
    turns = {effect.form: effect.parameters[1] for effect in effects}
    assert [turns[f"joint {i}"].starts[0] for i in (1, 2, 3)] == pytest.approx([0.3, 0.5, 0.3])
    assert turns["joint 2"].neutral == pytest.approx(0.5)
