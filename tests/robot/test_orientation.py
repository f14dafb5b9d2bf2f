"""Euler angles and quaternions: round trips, and the same rotation by SciPy and by the arm's own matrices."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from metro.robot.kinematics import rotation
from metro.robot.orientation import (
    euler_of_matrix,
    euler_of_quaternion,
    matrix_of_euler,
    matrix_of_quaternion,
    quaternion_of_euler,
    quaternion_of_matrix,
)

ANGLE = st.floats(-np.pi, np.pi)
ANGLES = st.tuples(ANGLE, st.floats(-np.pi / 2, np.pi / 2), ANGLE)


@given(ANGLES)
def test_angles_to_a_quaternion_and_back_are_the_same_rotation(angles):
    quaternion = quaternion_of_euler(np.array(angles))
    back = euler_of_quaternion(quaternion)
    assert np.linalg.norm(quaternion) == pytest.approx(1.0, abs=1e-12)
    assert quaternion[0] >= 0.0
    # at a pole rz and rx are exchanged for each other: the rotation is what has to come back
    assert np.allclose(matrix_of_euler(back), matrix_of_euler(np.array(angles)), atol=1e-6)


@given(st.tuples(ANGLE, st.floats(-1.5, 1.5), ANGLE))
def test_away_from_the_poles_the_angles_themselves_come_back(angles):
    back = euler_of_quaternion(quaternion_of_euler(np.array(angles)))
    apart = np.angle(np.exp(1j * (back - np.array(angles))))
    assert np.allclose(apart, 0.0, atol=1e-9)


@given(ANGLES)
def test_the_conventions_are_those_of_scipy_and_of_the_work_frame(angles):
    rx, ry, rz = angles
    turn = matrix_of_euler(np.array(angles))
    other = Rotation.from_euler("ZYX", [rz, ry, rx])
    assert np.allclose(turn, other.as_matrix(), atol=1e-12)
    assert np.allclose(turn, rotation(rx, ry, rz), atol=1e-12)
    quaternion = quaternion_of_matrix(turn)
    vector, scalar = other.as_quat()[:3], other.as_quat()[3]
    assert abs(quaternion @ np.array([scalar, *vector])) == pytest.approx(1.0, abs=1e-12)
    assert np.allclose(matrix_of_quaternion(quaternion), turn, atol=1e-12)


def test_the_published_tool_frame_has_the_quaternion_of_a_quarter_turn_about_z():
    """[F] table 4: alpha 0, beta 0, gamma 90 degrees."""
    quaternion = quaternion_of_euler(np.radians([0.0, 0.0, 90.0]))
    assert quaternion == pytest.approx([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)], abs=1e-15)


def test_half_turns_lose_no_digits_and_a_pole_gives_rz_alone():
    for axis in np.eye(3):
        turn = 2 * np.outer(axis, axis) - np.eye(3)
        assert np.abs(quaternion_of_matrix(turn)) == pytest.approx([0.0, *axis], abs=1e-15)
    rx, ry, rz = euler_of_matrix(matrix_of_euler(np.array([0.3, np.pi / 2, 1.1])))
    assert (rx, ry, rz) == pytest.approx((0.0, np.pi / 2, 0.8), abs=1e-7)


def test_arrays_keep_their_shape_and_a_quaternion_without_length_is_refused():
    angles = np.random.default_rng(1).uniform(-1, 1, (4, 5, 3))
    assert euler_of_quaternion(quaternion_of_euler(angles)) == pytest.approx(angles)
    with pytest.raises(ValueError, match="length zero"):
        matrix_of_quaternion(np.zeros(4))
