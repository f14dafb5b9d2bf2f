"""Kinematics, statics and logs of the simulated robot."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from virtual_cell.arm import rotation_rpy
from virtual_cell.recipes.kr160 import ARM, DRIVES
from virtual_cell.robot import log, straight_path, tracking
from virtual_cell.units import DEG

Q = np.array([-20.3, -13.9, -4.4, -61.7, 34.9, 56.7]) * DEG


def printed_matrix(theta, alpha, d, a):
    """The transformation of the paper, with its erratum mended."""
    c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    return np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])


def path():
    position, axes = ARM.pose(Q)
    return straight_path(ARM, (position, position + axes @ np.array([0.06, 0.0, 0.0])), axes, 0.02, Q), axes


def test_forward_kinematics_is_the_product_of_the_printed_matrices():
    flange = np.eye(4)
    for (theta, alpha, d, a), q in zip(ARM.dh, Q, strict=True):
        flange = flange @ printed_matrix(theta * DEG + q, alpha * DEG, d / 1e3, a / 1e3)
    np.testing.assert_allclose(ARM.frames(Q)[6], flange, atol=1e-12)
    np.testing.assert_allclose(ARM.pose(Q)[0], (flange @ [*ARM.tip, 1.0])[:3], atol=1e-12)


def test_inverse_kinematics_comes_back():
    found = ARM.reach(*ARM.pose(Q), Q + 0.05)
    np.testing.assert_allclose(found, Q, atol=1e-9)


def test_a_point_out_of_reach_is_refused():
    with pytest.raises(RuntimeError, match="does not reach"):
        ARM.reach(np.array([4.0, 0.0, 0.0]), np.eye(3), Q)


def test_a_path_is_straight_and_keeps_the_orientation():
    followed, axes = path()
    for s in (0.0, 0.0235, 0.06):
        q = followed.at(np.array([s]))[0]
        at, turned = ARM.pose(q)
        np.testing.assert_allclose(at, followed.position[0] + axes[:, 0] * s, atol=1e-7)
        np.testing.assert_allclose(turned, axes, atol=1e-6)


def test_jacobian_is_the_derivative_of_the_pose():
    for joint in range(6):
        step = 1e-6 * np.eye(6)[joint]
        (p1, r1), (p0, r0) = ARM.pose(Q + step), ARM.pose(Q - step)
        twist = Rotation.from_matrix(r1 @ r0.T).as_rotvec()
        np.testing.assert_allclose(
            ARM.jacobian(Q)[:, joint], np.concatenate([p1 - p0, twist]) / 2e-6, atol=1e-8
        )


def test_gravity_torque_is_the_slope_of_the_potential():
    def potential(q):
        return 9.81 * ARM.masses @ ARM.frames(q)[1:, 2, 3]

    slope = [(potential(Q + h) - potential(Q - h)) / 2e-6 for h in 1e-6 * np.eye(6)]
    np.testing.assert_allclose(ARM.gravity(Q), slope, atol=1e-5)


def test_joint_torque_of_a_load_is_virtual_work_with_the_sign_of_the_contract():
    followed, _ = path()
    force = np.array([30.0, -120.0, 45.0])
    rng = np.random.default_rng
    loaded = log(ARM, DRIVES, followed, lambda s: np.tile(force, (len(s), 1)), rng(3), begin=0.0)
    idle = log(ARM, DRIVES, followed, None, rng(3), begin=0.0)
    q = np.array([idle[f"q{i}_set_deg"][5] for i in range(1, 7)]) * DEG
    for joint in range(6):
        step = 1e-6 * np.eye(6)[joint]
        work = force @ (ARM.pose(q + step)[0] - ARM.pose(q - step)[0]) / 2e-6
        change = loaded[f"tau{joint + 1}_nm"] - idle[f"tau{joint + 1}_nm"]
        assert change[5] == pytest.approx(-work, abs=0.11)


def test_the_tip_yields_along_the_load_by_the_energy_in_the_joints():
    force = np.array([100.0, 50.0, -80.0])
    torque = ARM.jacobian(Q)[:3].T @ force
    assert force @ ARM.yields(Q, force) == pytest.approx(np.sum(torque**2 / ARM.stiffness))


def test_lag_moves_the_tip_back_along_the_path_only():
    followed, axes = path()
    smooth = type(DRIVES)(DRIVES.coulomb, DRIVES.viscous, 0.004, np.zeros(6), np.zeros(6), np.ones(6), 0.0)
    s = np.array([0.03])
    moved = ARM.pose((followed.at(s) + tracking(smooth, followed, s))[0])[0] - ARM.pose(followed.at(s)[0])[0]
    np.testing.assert_allclose(axes.T @ moved, [-0.004 * 0.02, 0.0, 0.0], atol=1e-7)


def test_rpy_turns_about_x_then_y_then_z():
    expected = Rotation.from_euler("xyz", [10.0, 20.0, 30.0], degrees=True).as_matrix()
    np.testing.assert_allclose(rotation_rpy(10 * DEG, 20 * DEG, 30 * DEG), expected, atol=1e-12)
