"""Forces and deflections by virtual work, symmetry and limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kr160_arm import arm_with_tool

from metro.robot.kinematics import Arm
from metro.robot.statics import (
    deflections,
    joint_contributions,
    joint_torque,
    moving_jacobian,
    tip_compliance,
    tip_jacobian,
    wrench_map,
)

ARM = arm_with_tool(work_in_base={"xyz_mm": [1200, 0, 500], "rpy_deg": [10, -20, 30]})
COMPLIANCE = 1 / np.array([4.6e6, 4.8e6, 3.3e6, 5.2e5, 6.1e5, 3.9e5])
angles = st.lists(st.floats(-2.5, 2.5), min_size=6, max_size=6).map(np.array)
vectors = st.lists(st.floats(-300, 300), min_size=3, max_size=3).map(np.array)


def work_of_tip(arm, q, direction, force, step=1e-6):
    """f·δx of a small joint movement, by differences of the forward kinematics alone."""
    return force @ (arm.tip(q + step * direction) - arm.tip(q - step * direction)) / (2 * step)


@given(angles, vectors)
@settings(max_examples=40, deadline=None)
def test_motor_torques_do_the_work_that_the_tip_force_takes_away(q, force):
    torque = joint_torque(tip_jacobian(ARM, q), force)
    for i in range(6):
        assert torque[i] == pytest.approx(-work_of_tip(ARM, q, np.eye(6)[i], force), abs=1e-5)


def test_the_printed_equation_13_fails_virtual_work():
    """[K] eq. 13 exchanges the lever arms of the x row and the z row: it does not balance, W does."""
    x, _, z = ARM.tool
    in_flange = np.array([[0, 0, -1], [0, -1, 0], [-1, 0, 0]])  # columns: axes of the tool
    printed = np.array([[0, 0, -1, 0, -z, 0], [0, -1, 0, z, 0, -x], [-1, 0, 0, 0, x, 0]]).T
    twist = np.array([1e-3, -2e-3, 5e-4, 0.01, -0.02, 0.015])
    for axis, balanced in zip(range(3), (False, True, False), strict=True):
        work = in_flange[:, axis] @ (twist[:3] + np.cross(twist[3:], ARM.tool))
        geometric = (wrench_map(ARM.tool) @ in_flange)[:, axis]
        assert geometric @ twist == pytest.approx(work, abs=1e-15)
        assert bool(abs(printed[:, axis] @ twist - work) < 1e-9) is balanced


@given(angles)
@settings(max_examples=30, deadline=None)
def test_tip_compliance_is_symmetric_and_never_negative(q):
    matrix = tip_compliance(ARM, q, COMPLIANCE)
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-20)
    assert np.linalg.eigvalsh(matrix).min() > -1e-18


@given(angles, vectors)
@settings(max_examples=30, deadline=None)
def test_the_deflection_is_the_tip_of_the_arm_with_its_joints_twisted(q, force):
    """Springs give way by c × the torque on them: forward kinematics of the twisted arm, to first order."""
    springs = -joint_torque(tip_jacobian(ARM, q), force) * COMPLIANCE
    small = 1e-3
    moved = (ARM.tip(q + small * springs) - ARM.tip(q - small * springs)) / (2 * small)
    np.testing.assert_allclose(joint_contributions(ARM, q, force) @ COMPLIANCE, moved, rtol=1e-6, atol=1e-10)
    np.testing.assert_allclose(tip_compliance(ARM, q, COMPLIANCE) @ force, moved, rtol=1e-6, atol=1e-10)


def test_elastic_energy_is_stored_in_the_joints():
    q, force = np.array([0.1, -0.9, 1.2, 0.3, 0.8, 0.2]), np.array([100.0, -180.0, 40.0])
    torque = joint_torque(tip_jacobian(ARM, q), force)
    energy = 0.5 * (torque**2 * COMPLIANCE).sum()
    assert 0.5 * force @ tip_compliance(ARM, q, COMPLIANCE) @ force == pytest.approx(energy)


def test_without_flange_rotation_the_tip_moves_as_the_flange():
    """[K]: the wrong model leaves out ω × p, which is most of what joint 6 does."""
    q, force = np.array([0.1, -0.9, 1.2, 0.3, 0.8, 0.2]), np.array([100.0, -180.0, 40.0])
    springs = -joint_torque(tip_jacobian(ARM, q), force) * COMPLIANCE
    small = 1e-3
    on_flange = Arm(ARM.dh, np.zeros(3), ARM.work)
    moved = (on_flange.tip(q + small * springs) - on_flange.tip(q - small * springs)) / (2 * small)
    found = joint_contributions(ARM, q, force, flange_rotation=False) @ COMPLIANCE
    np.testing.assert_allclose(found, moved, rtol=1e-6)
    assert np.abs(moving_jacobian(ARM, q, 0.0)[:, 5]).max() < 1e-12
    assert np.abs(tip_jacobian(ARM, q)[:, 5]).max() > 0.2


def test_a_series_of_poses_and_forces_is_taken_at_once():
    rng = np.random.default_rng(2)
    q, force = rng.uniform(-1, 1, (4, 6)), rng.normal(0, 100, (4, 3))
    singly = [joint_contributions(ARM, a, f) for a, f in zip(q, force, strict=True)]
    np.testing.assert_allclose(joint_contributions(ARM, q, force), singly, atol=1e-15)
    singly = [tip_compliance(ARM, a, COMPLIANCE) for a in q]
    np.testing.assert_allclose(tip_compliance(ARM, q, COMPLIANCE), singly, atol=1e-18)


def test_tip_and_flange_go_where_the_twisted_arm_takes_them():
    """[K] eq. 16 to 18 against the forward kinematics of the arm with its joints twisted, both ways."""
    rng = np.random.default_rng(8)
    q, twist = rng.uniform(-1, 1, (5, 6)), rng.normal(0, 1e-3, (5, 6))
    flange, turned, tip = deflections(ARM, q, twist)
    on_flange = Arm(ARM.dh, np.zeros(3), ARM.work)
    small = 1e-3
    for arm, moved in ((on_flange, flange), (ARM, tip)):
        expected = (arm.tip(q + small * twist) - arm.tip(q - small * twist)) / (2 * small)
        np.testing.assert_allclose(moved, expected, rtol=1e-5, atol=1e-9)
    for axis in np.eye(3):
        pointer = Arm(ARM.dh, axis, ARM.work)
        ahead = pointer.tip(q) - on_flange.tip(q)
        after = pointer.tip(q + small * twist) - on_flange.tip(q + small * twist)
        before = pointer.tip(q - small * twist) - on_flange.tip(q - small * twist)
        np.testing.assert_allclose(
            np.cross(turned, ahead), (after - before) / (2 * small), rtol=1e-5, atol=1e-9
        )


def test_half_of_the_rotation_of_the_flange_moves_the_tip_half_way():
    q, force = np.array([0.1, -0.9, 1.2, 0.3, 0.8, 0.2]), np.array([100.0, -180.0, 40.0])
    none, half, whole = (joint_contributions(ARM, q, force, flange_rotation=s) for s in (0.0, 0.5, 1.0))
    np.testing.assert_allclose(half, (none + whole) / 2, atol=1e-12)
