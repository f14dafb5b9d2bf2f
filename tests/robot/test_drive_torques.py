"""Torques of friction, each part alone against its formula."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from metro.robot.drive_torques import LEAST_TURN, TURNING, DriveTorques, Ripple, slid

RATE, T = np.array([[0.2], [-0.1], [0.3]]) * np.ones(6), np.array([0.0, 1.0, 4.0])
Q = np.array([[0.0], [-0.05], [0.25]]) * np.ones(6)


@pytest.mark.parametrize("part", ["reversal", "warmup", "viscous"])
def test_each_part_of_friction_is_there_alone(part):
    side = np.array([-1.0, -1.0, 1.0])  # the way that it goes, from the start on
    expected = {"reversal": 3.0 * side, "warmup": 3.0 * T * side, "viscous": 3.0 * RATE[:, 2]}[part]
    torque = DriveTorques().with_friction(2, **{part: 3.0}).at(Q, RATE, T)
    assert torque[:, 2] == pytest.approx(expected)
    assert not np.delete(torque, 2, axis=1).any()


def test_friction_follows_the_way_on_which_a_joint_turns_round():
    """Dahl's differential equation, integrated by another package in small steps."""
    t = np.linspace(0.0, 4.0, 401)
    q, rate = 2e-3 * np.sin(1.3 * t), 2.6e-3 * np.cos(1.3 * t)
    turn = 4e-4

    def slope(at, state):
        speed = 2.6e-3 * np.cos(1.3 * at)
        return (np.sign(speed) - state) * abs(speed) / turn

    whole = solve_ivp(slope, (0.0, 4.0), [1.0], t_eval=t, max_step=1e-3, rtol=1e-8)
    np.testing.assert_allclose(slid(q, rate, turn), whole.y[0], atol=5e-3)


def test_friction_without_presliding_follows_the_speed_and_there_is_none_where_that_is_unknown():
    q, rate = np.linspace(0.0, 1e-2, 5), np.array([1e-4, 2e-4, -2e-4, 1e-3, 0.0])
    np.testing.assert_allclose(slid(q, rate, 0.0), np.tanh(rate / TURNING))
    assert not slid(q, np.zeros(5), 3e-4).any()


def test_a_joint_of_which_something_else_is_believed_keeps_it():
    told = DriveTorques().with_friction(3, reversal=1.0).with_presliding(3, 1e-3)
    t = np.linspace(0.0, 1.0, 50)
    q = np.zeros((50, 6))
    q[:, 3] = 2e-3 * np.cos(2 * np.pi * t)
    rate = np.gradient(q, t, axis=0)
    np.testing.assert_allclose(told.at(q, rate, t)[:, 3], slid(q[:, 3], rate[:, 3], 1e-3))


@pytest.mark.parametrize("turn", [0.0, LEAST_TURN])
def test_a_turn_near_none_goes_over_to_friction_by_speed_without_a_jump(turn):
    q = 0.01 * np.sin(np.linspace(0.0, 3.0, 200))
    rate = np.gradient(q, 0.05)
    beside = slid(q, rate, turn + 1e-9), slid(q, rate, max(turn - 1e-9, 0.0))
    np.testing.assert_allclose(beside[0], beside[1], atol=1e-4)
    assert np.abs(slid(q, rate, 0.0) - slid(q, rate, LEAST_TURN)).max() > 0.01


def test_friction_that_changes_is_more_where_a_joint_creeps_and_what_is_viscous_is_not():
    q = np.column_stack([np.linspace(0.0, 0.1, 50)] * 2)
    rate = np.full((50, 2), 0.01)
    peak = np.column_stack([np.linspace(1.4, 0.9, 50), np.ones(50)])
    drives = DriveTorques().with_friction(0, reversal=3.0).with_friction(1, viscous=50.0)
    t = np.zeros(50)
    even, peaked = drives.at(q, rate, t), drives.at(q, rate, t, peak=peak)
    np.testing.assert_allclose(peaked[:, 0], even[:, 0] * peak[:, 0])
    np.testing.assert_array_equal(peaked[:, 1], even[:, 1])


def test_a_ripple_is_its_mean_over_the_width_of_a_bin():
    rate, width, middle = 0.3, 0.5, np.array([0.2, 1.1])
    ripple = DriveTorques(ripple=(Ripple(0, 40.0, 3.0, -2.0),))
    found = ripple.at(rate * middle[:, None], np.full((2, 1), rate), middle, width)[:, 0]
    angle = 40.0 * rate * (middle + width * (np.arange(20_000) + 0.5)[:, None] / 20_000 - width / 2)
    expected = (3.0 * np.sin(angle) - 2.0 * np.cos(angle)).mean(axis=0)
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    assert np.abs(expected).max() < 0.5 * np.hypot(3.0, 2.0)
