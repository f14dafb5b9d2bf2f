"""Inverse kinematics against forward kinematics, which share no step, and against a closed form."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kr160_arm import DH

from metro.robot.inverse import LEVER, OutOfReachError, _moves, _turned, joints_at, nearest_joints
from metro.robot.kinematics import Arm, rotation, transform

ARM = Arm(DH, np.array([0.02, -0.03, 0.25]), transform(np.array([1.1, 0.2, 0.4]), rotation(0.1, -0.2, 0.7)))
joints = st.tuples(*[st.floats(-1.2, 1.2) for _ in range(6)]).map(np.array)


@given(joints, joints)
@settings(max_examples=40, deadline=None)
def test_the_tip_comes_to_where_it_is_wanted(q, away):
    q = q + np.array([0.0, 0.0, 0.0, 0.0, 0.9 if q[4] >= 0 else -0.9, 0.0])  # beside the singular wrist
    found = joints_at(ARM, ARM.tip(q)[None], ARM.flange_axes(q)[None], q + 0.15 * away)[0]
    assert ARM.tip(found) == pytest.approx(ARM.tip(q), abs=2e-8)
    assert ARM.flange_axes(found) == pytest.approx(ARM.flange_axes(q), abs=2e-7)


@given(joints)
@settings(max_examples=20, deadline=None)
def test_what_joints_move_is_the_derivative_of_place_and_turn(q):
    found, step = _moves(ARM, q), 1e-6
    for i, one in enumerate(step * np.eye(6)):
        assert found[:3, i] == pytest.approx((ARM.tip(q + one) - ARM.tip(q - one)) / (2 * step), abs=1e-7)
        about = _turned(ARM.flange_axes(q + one)[None], ARM.flange_axes(q - one)[None])[0]
        assert found[3:, i] == pytest.approx(LEVER * about / (2 * step), abs=1e-7)


def test_a_path_is_followed_in_one_posture():
    ends = np.array([[0.1, -0.2, 0.3, 0.2, 0.8, -0.1], [0.5, 0.1, 0.0, 0.6, 0.5, 0.3]])
    truth = ends[0] + np.linspace(0.0, 1.0, 40)[:, None] * (ends[1] - ends[0])
    found = joints_at(ARM, ARM.tip(truth), ARM.flange_axes(truth), truth[0] + 0.05)
    assert found == pytest.approx(truth, abs=1e-5)


def test_a_plane_arm_of_two_links_has_the_angles_of_the_cosine_rule():
    """With a wrist that keeps the tool upright: three joints about z, so that the place is in their plane."""
    first, second, third = 0.5, 0.4, 0.1
    dh = np.array([[0.0, 0.0, 0.0, first], [0.0, 0.0, 0.0, second], [0.0, 0.0, 0.0, third]])
    arm = Arm(dh, np.zeros(3), np.eye(4))
    x, y = 0.55, 0.3
    wrist = np.hypot(x, y)
    elbow = np.pi - np.arccos((first**2 + second**2 - wrist**2) / (2 * first * second))
    shoulder = np.arctan2(y, x) - np.arctan2(second * np.sin(elbow), first + second * np.cos(elbow))
    place = np.array([[x + third, y, 0.0]])
    found = joints_at(arm, place, np.eye(3)[None], np.array([0.2, 0.5, -0.6]))[0]
    assert found == pytest.approx([shoulder, elbow, -shoulder - elbow], abs=1e-6)


def test_a_place_out_of_reach_is_named():
    q = np.array([0.1, -0.2, 0.3, 0.2, 0.8, -0.1])
    places = np.array([ARM.tip(q), [5.0, 0.0, 0.0]])
    with pytest.raises(OutOfReachError, match="target 2: the declared arm comes to"):
        joints_at(ARM, places, np.repeat(ARM.flange_axes(q)[None], 2, axis=0), q)


def test_a_search_begins_at_the_nearest_pose_turned_alike():
    rng = np.random.default_rng(3)
    known = rng.uniform(-1.0, 1.0, (50, 6))
    known[20] = known[10] + [0.0, 0.0, 0.0, 0.0, 0.0, 2.0]  # another turn of the flange, the tip nearby
    place, turn = ARM.tip(known[10]), ARM.flange_axes(known[10])
    assert nearest_joints(ARM, place, turn, known) == pytest.approx(known[10])
    assert nearest_joints(ARM, ARM.tip(known[30]), None, known) == pytest.approx(known[30])
