"""Random arms against products of exponentials by SciPy, and against pinocchio where it is installed."""

from functools import cache

import numpy as np
import pytest
from cost import cost_ratio
from scipy.linalg import expm

from metro.robot.kinematics import Arm, forward, jacobian, link_frames, rotation, transform
from metro.robot.rigid_body import torque_regressor
from metro.robot.statics import (
    joint_contributions,
    joint_torque,
    moving_jacobian,
    tip_compliance,
    tip_jacobian,
)
from metro.robot.tracking import tracking_error

SEEDS = range(8)


@cache
def pinocchio():
    return pytest.importorskip("pinocchio", reason="pinocchio (pin) is not installed (development only)")


def random_arm(seed):
    rng = np.random.default_rng(seed)
    dh = rng.uniform(-1, 1, (6, 4)) * (np.pi, np.pi, 0.8, 0.8)
    work = transform(rng.uniform(-1, 1, 3), rotation(*rng.uniform(-3, 3, 3)))
    return Arm(dh, rng.uniform(-0.4, 0.4, 3), work), rng.uniform(-3, 3, (6, 6)), rng


def screws(dh):
    """Screw axes (v, ω) of the joints at q = 0 and the flange's pose there, by elementary motions alone."""
    pose, axes = np.eye(4), []
    for theta, alpha, d, a in dh:
        axis, point = pose[:3, 2], pose[:3, 3]
        axes.append(np.r_[np.cross(point, axis), axis])
        for screw in ((0, 0, d, 0, 0, theta), (a, 0, 0, alpha, 0, 0)):
            pose = pose @ expm(hat(np.array(screw)))
    return np.array(axes), pose


def hat(twist):
    x, y, z = twist[3:]
    return np.block([[np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), twist[:3, None]], [np.zeros((1, 4))]])


@pytest.mark.parametrize("seed", SEEDS)
def test_poses_and_jacobians_are_those_of_products_of_exponentials(seed):
    """T = e^[S₁]q₁ … e^[S₆]q₆ M (Lynch & Park, Modern Robotics, 2017, eqs. 4.14 and 5.11)."""
    arm, q, _ = random_arm(seed)
    axes, home = screws(arm.dh)
    for angles in q:
        moved, columns = np.eye(4), []
        for axis, angle in zip(axes, angles, strict=True):
            twist = moved @ hat(axis) @ np.linalg.inv(moved)
            omega = np.array([twist[2, 1], twist[0, 2], twist[1, 0]])
            columns.append((twist[:3, 3], omega))
            moved = moved @ expm(hat(axis) * angle)
        pose = moved @ home
        np.testing.assert_allclose(forward(arm.dh, angles), pose, atol=1e-12)
        expected = np.array([np.r_[v + np.cross(omega, pose[:3, 3]), omega] for v, omega in columns]).T
        np.testing.assert_allclose(jacobian(arm.dh, angles), expected, atol=1e-12)


def model_of(arm, links=None):
    """Build the arm in pinocchio joint by joint, from rotations and translations alone."""
    pin = pinocchio()
    model, parent, placement = pin.Model(), 0, pin.SE3.Identity()
    for i, (theta, alpha, d, a) in enumerate(arm.dh):
        placement = placement * pin.SE3(pin.utils.rotate("z", theta), np.zeros(3))
        parent = model.addJoint(parent, pin.JointModelRZ(), placement, f"joint {i + 1}")
        placement = pin.SE3(np.eye(3), np.array([0, 0, d])) * pin.SE3(
            pin.utils.rotate("x", alpha), np.array([a, 0, 0])
        )
        if links is not None:
            model.appendBodyToJoint(parent, links[i], placement)
    model.addFrame(pin.Frame("flange", parent, placement, pin.FrameType.OP_FRAME))
    tip = placement * pin.SE3(np.eye(3), arm.tool)
    model.addFrame(pin.Frame("tip", parent, tip, pin.FrameType.OP_FRAME))
    return model, model.createData()


@pytest.mark.parametrize("seed", SEEDS)
def test_poses_jacobians_torques_and_deflections_are_those_of_pinocchio(seed):
    pin = pinocchio()
    arm, q, rng = random_arm(seed)
    model, data = model_of(arm)
    to_work, compliance = arm.work[:3, :3].T, rng.uniform(1e-7, 3e-6, 6)
    for angles in q:
        pin.forwardKinematics(model, data, angles)
        pin.updateFramePlacements(model, data)
        flange, tip = (data.oMf[model.getFrameId(name)] for name in ("flange", "tip"))
        np.testing.assert_allclose(forward(arm.dh, angles), flange.homogeneous, atol=1e-13)
        np.testing.assert_allclose(arm.tip(angles), to_work @ (tip.translation - arm.work[:3, 3]), atol=1e-13)
        for i in range(6):
            found = link_frames(arm.dh, angles)[i, :3, 2]
            np.testing.assert_allclose(found, data.oMi[i + 1].rotation[:, 2], atol=1e-13)
        at = [
            pin.computeFrameJacobian(model, data, angles, model.getFrameId(name), pin.LOCAL_WORLD_ALIGNED)
            for name in ("flange", "tip")
        ]
        np.testing.assert_allclose(jacobian(arm.dh, angles), at[0], atol=1e-13)
        np.testing.assert_allclose(moving_jacobian(arm, angles, 0.0), to_work @ at[0][:3], atol=1e-13)
        np.testing.assert_allclose(tip_jacobian(arm, angles), to_work @ at[1][:3], atol=1e-13)
        force = rng.normal(0, 200, 3)
        wrench = np.r_[arm.work[:3, :3] @ force, np.zeros(3)]
        np.testing.assert_allclose(
            joint_torque(tip_jacobian(arm, angles), force), -at[1].T @ wrench, atol=1e-10
        )
        stiff = to_work @ (at[1][:3] @ np.diag(compliance) @ at[1].T @ wrench)
        np.testing.assert_allclose(joint_contributions(arm, angles, force) @ compliance, stiff, atol=1e-15)
        np.testing.assert_allclose(tip_compliance(arm, angles, compliance) @ force, stiff, atol=1e-15)


@pytest.mark.parametrize("seed", SEEDS)
def test_pose_errors_are_those_of_pinocchio(seed):
    pin = pinocchio()
    arm, q, rng = random_arm(seed)
    model, data = model_of(arm)
    measured = q + rng.normal(0, 1e-3, q.shape)
    found, turned = tracking_error(arm, measured, q), arm.work[:3, :3].T
    for k in range(len(q)):
        poses = []
        for angles in (measured[k], q[k]):
            pin.framesForwardKinematics(model, data, angles)
            poses.append([data.oMf[model.getFrameId(name)].copy() for name in ("flange", "tip")])
        shifts = [turned @ (a.translation - b.translation) for a, b in zip(*poses, strict=True)]
        turn = turned @ pin.log3(poses[0][0].rotation @ poses[1][0].rotation.T)
        np.testing.assert_allclose([found.flange[k], found.tip[k]], shifts, atol=1e-13)
        np.testing.assert_allclose(found.rotation[k], turn, atol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_torques_of_moving_links_are_those_of_pinocchio(seed):
    pin = pinocchio()
    arm, q, rng = random_arm(seed)
    rate, acceleration = rng.normal(0, 2, q.shape), rng.normal(0, 5, q.shape)
    links = [pin.Inertia.Random() for _ in range(6)]
    model, data = model_of(arm, links)
    parameters = []
    for link in links:
        mass, c = link.mass, link.lever
        about_origin = link.inertia + mass * (c @ c * np.eye(3) - np.outer(c, c))
        parameters.append(np.r_[mass, mass * c, about_origin[np.triu_indices(3)]])
    expected = [pin.rnea(model, data, *row) for row in zip(q, rate, acceleration, strict=True)]
    found = torque_regressor(arm.dh, q, rate, acceleration) @ np.concatenate(parameters)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_virtual_work_balances_for_random_arms(seed):
    """The tip's force does f·δx, the motors −τ·δq of it, by differences of the forward kinematics alone."""
    arm, q, rng = random_arm(seed)
    force, direction, step = rng.normal(0, 200, (len(q), 3)), rng.normal(0, 1, q.shape), 1e-6
    moved = (arm.tip(q + step * direction) - arm.tip(q - step * direction)) / (2 * step)
    torque = joint_torque(tip_jacobian(arm, q), force)
    np.testing.assert_allclose(np.sum(torque * direction, 1), -np.sum(force * moved, 1), rtol=1e-6, atol=1e-4)


def test_poses_and_jacobians_cost_a_few_chains_of_six_products():
    arm, _, rng = random_arm(0)
    q = rng.uniform(-1, 1, (50_000, 6))
    turn = np.broadcast_to(np.eye(4), (50_000, 4, 4)).copy()

    def poses():
        forward(arm.dh, q)
        jacobian(arm.dh, q)

    assert cost_ratio(poses, lambda: [turn @ turn for _ in range(6)]) < 25.0
