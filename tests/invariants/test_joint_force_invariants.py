"""The force at the tip does not depend on the work frame, on units, or on the names of joints and places."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from metro.robot.kinematics import arm_of_cell
from metro.robot.sensorless import tip_force
from metro.robot.statics import joint_torque, tip_compliance, tip_jacobian

FEW = settings(max_examples=20, deadline=None, derandomize=True, database=None)
ROWS = [
    [0, 90, 500, 250], [90, 0, 0, 610], [-180, -90, 0, 70], [0, 90, 710, 0], [0, -90, 0, 0], [0, 0, 215, 0],
]  # fmt: skip
ARM = arm_of_cell({"arm": {"dh": ROWS}}, {"tool_in_flange_mm": [212.5, 0.0, 279.91]})
VARIANCE = np.array([9.0, 8.0, 5.0, 1.0, 1.2, 0.7])
PLACES = 12
TURNS = st.tuples(*[st.floats(-3.0, 3.0)] * 3)


@st.composite
def logs(draw):
    """Joint angles, torques and their variances at places along a path, and the index of each joint."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    start = np.array([0.2, -0.6, 0.9, 0.4, 0.8, -0.3]) + rng.uniform(-0.2, 0.2, 6)
    q = start + np.linspace(0.0, 0.2, PLACES)[:, None] * rng.uniform(-1.0, 1.0, 6)
    torque = joint_torque(tip_jacobian(ARM, q), rng.uniform(-300.0, 300.0, 3)) + rng.normal(size=(PLACES, 6))
    return q, torque, VARIANCE * rng.uniform(0.8, 1.2, (PLACES, 6)), rng.permutation(np.arange(3.0, 9.0))


def same(found, expected):
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-8 * np.abs(expected).max())


@FEW
@given(logs(), TURNS)
def test_in_a_turned_work_frame_force_covariance_and_compliance_turn_with_it(log, turn):
    q, torque, variance, index = log
    work = np.eye(4)
    work[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    turned = replace(ARM, work=ARM.work @ work)
    here, there = (tip_force(torque, variance, tip_jacobian(arm, q), index) for arm in (ARM, turned))
    back = work[:3, :3]
    same(there.force @ back.T, here.force)
    same(back @ there.covariance @ back.T, here.covariance)
    give = 1.0 / np.array([1e6, 1.1e6, 9e5, 2e5, 1.8e5, 1e5])
    same(back @ tip_compliance(turned, q, give) @ back.T, tip_compliance(ARM, q, give))


@FEW
@given(logs(), st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))
def test_in_other_units_of_length_and_force_the_force_is_the_same(log, length, force):
    q, torque, variance, index = log
    jacobian, unit = tip_jacobian(ARM, q), length * force
    here = tip_force(torque, variance, jacobian, index)
    there = tip_force(torque * unit, variance * unit**2, jacobian * length, index)
    same(there.force / force, here.force)
    same(there.covariance / force**2, here.covariance)
    np.testing.assert_array_equal(there.used, here.used)


@FEW
@given(logs(), st.permutations(range(6)))
def test_joints_may_have_other_numbers(log, order):
    q, torque, variance, index = log
    order, jacobian = list(order), tip_jacobian(ARM, q)
    here = tip_force(torque, variance, jacobian, index)
    there = tip_force(torque[:, order], variance[:, order], jacobian[:, :, order], index[order])
    np.testing.assert_array_equal(there.used, here.used[order])
    same(there.force, here.force)


@FEW
@given(logs(), st.permutations(range(PLACES)))
def test_places_may_come_in_any_order(log, order):
    q, torque, variance, index = log
    order, jacobian = list(order), tip_jacobian(ARM, q)
    here = tip_force(torque, variance, jacobian, index)
    same(tip_force(torque[order], variance[order], jacobian[order], index).force, here.force[order])


@FEW
@given(logs(), st.integers(2, 5))
def test_a_log_of_more_samples_of_the_same_has_the_same_force(log, times):
    q, torque, variance, index = (np.repeat(each, times, axis=0) for each in (*log[:3], log[3][None]))
    here = tip_force(*log[1:3], tip_jacobian(ARM, log[0]), log[3])
    there = tip_force(torque, variance, tip_jacobian(ARM, q), index[0])
    same(there.force[::times], here.force)
    same(there.covariance[::times], here.covariance)
