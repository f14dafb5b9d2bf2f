"""Conditioning against the closed forms of the planar arm, the wrist and the elbow."""

import numpy as np
import pytest
from kr160_arm import DH

from metro.robot.conditioning import characteristic_length, conditioning
from metro.robot.kinematics import jacobian

Q = np.array([0.1, -0.4, 0.7, 0.3, 0.9, -0.2])


def test_a_planar_arm_has_the_manipulability_of_its_parallelogram():
    """Three joints in a plane: √det(J Jᵀ) = l₁ l₂ |sin q₂| (Yoshikawa 1985), whatever the third link."""
    dh = np.array([[0, 0, 0, 0.5], [0, 0, 0, 0.3], [0, 0, 0, 0.2]], float)
    q = np.random.default_rng(0).uniform(-3, 3, (20, 3))
    in_plane = np.zeros((20, 6, 3))
    in_plane[:, :3] = jacobian(dh, q)[:, [0, 1, 5]]
    found = np.linalg.svd(in_plane[:, :3])[1].prod(axis=1)
    np.testing.assert_allclose(found, 0.15 * np.abs(np.sin(q[:, 1])), atol=1e-15)
    # the same as six tasks and joints: three more joints that each turn one axis alone, one rad per rad
    whole = np.zeros((20, 6, 6))
    whole[:, :3, :3] = in_plane[:, :3]
    whole[:, 3:, 3:] = np.eye(3)
    np.testing.assert_allclose(conditioning(whole, 1.0).manipulability, found, atol=1e-15)


def test_the_manipulability_of_a_wrist_arm_falls_as_the_sine_of_joint_5():
    bent = np.tile(Q, (8, 1))
    bent[:, 4] = np.linspace(0.05, 1.5, 8)
    at_wrist = DH.copy()
    at_wrist[5, 2] = 0.0  # seen at the wrist, whose place joint 5 does not change
    found = conditioning(jacobian(at_wrist, bent), 1.0).manipulability
    np.testing.assert_allclose(found / np.sin(bent[:, 4]), found[0] / np.sin(0.05), rtol=1e-10)


@pytest.mark.parametrize(("joint", "angle"), [(4, 0.0), (4, np.pi)])
def test_a_straight_wrist_is_singular_and_the_lost_direction_is_a_turn(joint, angle):
    q = Q.copy()
    q[joint] = angle
    at_wrist = DH.copy()
    at_wrist[5, 2] = 0.0
    matrix = jacobian(at_wrist, q)
    found = conditioning(matrix, 0.5)
    assert found.manipulability < 1e-15
    assert found.condition > 1e15
    assert found.weakest_gain < 1e-15
    scaled = matrix * np.repeat([1.0, 0.5], 3)[:, None]
    np.testing.assert_allclose(found.weakest @ scaled, 0, atol=1e-14)


def test_an_isotropic_jacobian_has_condition_one():
    turned = (
        np.linalg.qr(np.random.default_rng(2).normal(size=(6, 6)))[0] * np.repeat([1.0, 1 / 0.4], 3)[:, None]
    )
    assert conditioning(turned, 0.4).condition == pytest.approx(1.0)
    assert characteristic_length(turned) == pytest.approx(0.4)


def test_a_rotation_of_the_base_changes_nothing_and_a_length_unit_only_scales():
    matrix = jacobian(DH, Q)
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    turned = np.vstack([turn @ matrix[:3], turn @ matrix[3:]])
    length = characteristic_length(matrix)
    here, there = conditioning(matrix, length), conditioning(turned, length)
    assert there.condition == pytest.approx(here.condition)
    in_mm = conditioning(np.vstack([1e3 * matrix[:3], matrix[3:]]), 1e3 * length)
    assert in_mm.condition == pytest.approx(here.condition)
    assert in_mm.weakest_gain == pytest.approx(1e3 * here.weakest_gain)


def test_a_series_is_taken_at_once():
    q = np.random.default_rng(1).uniform(-2, 2, (7, 6))
    found = conditioning(jacobian(DH, q), 0.6)
    singly = [conditioning(jacobian(DH, row), 0.6).condition for row in q]
    np.testing.assert_allclose(found.condition, singly, rtol=1e-9)
