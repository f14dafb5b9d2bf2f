"""Tracking errors by closed forms, limits and SciPy's rotations."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kr160_arm import DH

from metro.robot.kinematics import Arm, forward, jacobian, rotation, transform
from metro.robot.tracking import tracking_error

ARM = Arm(DH, np.array([0.2125, 0.0, 0.27991]), transform(np.array([1.2, -0.1, 0.5]), rotation(0.1, -0.3, 2)))
angles = st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6).map(np.array)
vectors = st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3).map(np.array)


def test_a_joint_that_lags_moves_flange_and_tip_on_their_circles_about_its_axis():
    """Joint 1 alone: a chord 2 r sin(Δ/2), r the distance from its vertical axis, and a turn about z."""
    q, lag = np.array([0.3, -0.5, 0.8, 0.4, 0.7, -0.2]), 1e-4
    arm = Arm(DH, ARM.tool, np.eye(4))
    error = tracking_error(arm, q + lag * np.eye(6)[0], q)
    radius = np.linalg.norm(forward(DH, q)[:2, 3]), np.linalg.norm(arm.tip(q)[:2])
    chords = np.linalg.norm(error.flange), np.linalg.norm(error.tip)
    np.testing.assert_allclose(chords, 2 * np.array(radius) * np.sin(lag / 2), rtol=1e-9)
    np.testing.assert_allclose(error.rotation, [0, 0, lag], atol=1e-15)


def test_the_tip_moves_where_the_flange_stands_still_when_joint_6_lags():
    error = tracking_error(ARM, np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6 + 1e-4]), np.arange(0.1, 0.65, 0.1))
    np.testing.assert_allclose(error.flange, 0, atol=1e-16)
    assert np.linalg.norm(error.tip) == pytest.approx(0.2125 * 2 * np.sin(0.5e-4), rel=1e-9)


def test_ten_micrometres_at_the_flange_are_forty_at_the_tip():
    """[K]: the tip adds φ × p to the flange's 10 µm: 30 µm more where φ = 30 µm/|p| across the lever."""
    q = np.array([0.3, -0.5, 0.8, 0.4, 0.7, -0.2])
    wanted = forward(DH, q)
    lever = wanted[:3, :3] @ ARM.tool
    across = np.cross(lever, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    upward = np.cross(across, lever) / np.linalg.norm(lever)
    turn = 30e-6 / np.linalg.norm(lever)
    twist = np.r_[10e-6 * upward, turn * across]
    error = tracking_error(ARM, q + np.linalg.solve(jacobian(DH, q), twist), q)
    assert np.linalg.norm(error.flange) == pytest.approx(10e-6, rel=1e-3)
    assert np.linalg.norm(error.rotation) == pytest.approx(turn, rel=1e-3)
    assert np.linalg.norm(error.tip) == pytest.approx(40e-6, rel=1e-3)


@given(angles, vectors)
@settings(max_examples=30, deadline=None)
def test_the_errors_of_flange_and_tip_differ_by_the_turn_of_the_lever(q, size):
    lag = 1e-5 * np.r_[size, size[::-1]]
    error = tracking_error(ARM, q + lag, q)
    lever = ARM.lever(q) @ ARM.work[:3, :3]
    np.testing.assert_allclose(error.tip - error.flange, np.cross(error.rotation, lever), atol=1e-9)
    np.testing.assert_allclose(error.tip, ARM.tip(q + lag) - ARM.tip(q), atol=1e-15)


def test_a_series_is_taken_at_once_and_no_error_is_none():
    q = np.random.default_rng(1).uniform(-1, 1, (2, 4, 6))
    error = tracking_error(ARM, q, q)
    for part in (error.flange, error.tip, error.rotation):
        np.testing.assert_allclose(part, np.zeros((2, 4, 3)), atol=1e-15)
    one = tracking_error(ARM, q[0, 1] + 0.01, q[0, 1])
    np.testing.assert_allclose(tracking_error(ARM, q + 0.01, q).rotation[0, 1], one.rotation, atol=1e-15)
