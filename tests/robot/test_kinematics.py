"""The arm's geometry against hand-made poses, finite differences and the order of the rotations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kr160_arm import TOOL_MM, arm_with_tool

from metro.robot.kinematics import arm_of_cell, forward, jacobian, link_frames, rotation

ARM = arm_with_tool(work_in_base={"xyz_mm": [1200, -80, 500], "rpy_deg": [0, 0, 30]})
angles = st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6).map(np.array)


def turn(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)]["xyz".index(axis)]
    matrix = np.eye(3)
    matrix[i, i], matrix[j, j], matrix[i, j], matrix[j, i] = c, c, -s, s
    return matrix


def test_a_planar_two_link_arm_reaches_where_trigonometry_says():
    dh = np.array([[0.0, 0.0, 0.0, 0.5], [0.0, 0.0, 0.0, 0.3]])
    q = np.array([0.4, 0.7])
    expected = [0.5 * np.cos(0.4) + 0.3 * np.cos(1.1), 0.5 * np.sin(0.4) + 0.3 * np.sin(1.1), 0.0]
    np.testing.assert_allclose(forward(dh, q)[:3, 3], expected, atol=1e-15)


def test_the_kr160_at_zero_stands_where_its_drawing_says():
    """At q = 0 the upper arm points up: 250 mm out, 500 + 610 mm high; wrist to flange is 215 mm."""
    frames = link_frames(ARM.dh, np.zeros(6))
    np.testing.assert_allclose(frames[2, :3, 3], [0.25, 0, 0.5 + 0.61], atol=1e-12)
    wrist_to_flange = np.linalg.norm(frames[6, :3, 3] - frames[4, :3, 3])
    assert wrist_to_flange == pytest.approx(0.215)


@given(angles)
@settings(max_examples=30, deadline=None)
def test_every_frame_is_rigid(q):
    frames = link_frames(ARM.dh, q)
    turns = frames[:, :3, :3]
    np.testing.assert_allclose(
        turns @ np.swapaxes(turns, 1, 2), np.broadcast_to(np.eye(3), (7, 3, 3)), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(turns), 1.0, atol=1e-12)


@given(angles)
@settings(max_examples=30, deadline=None)
def test_the_jacobian_is_the_derivative_of_the_flange_pose(q):
    step = 1e-6
    found = jacobian(ARM.dh, q)
    middle = forward(ARM.dh, q)
    for i in range(6):
        move = step * np.eye(6)[i]
        ahead, behind = forward(ARM.dh, q + move), forward(ARM.dh, q - move)
        np.testing.assert_allclose(found[:3, i], (ahead - behind)[:3, 3] / (2 * step), atol=1e-8)
        spin = (ahead - behind)[:3, :3] / (2 * step) @ middle[:3, :3].T
        np.testing.assert_allclose(found[3:, i], [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-8)


def test_roll_turns_first_and_yaw_last():
    expected = turn("z", 0.3) @ turn("y", -0.8) @ turn("x", 1.1)
    np.testing.assert_allclose(rotation(1.1, -0.8, 0.3), expected, atol=1e-15)


def test_the_tip_in_the_work_frame_undoes_the_placing_of_the_work():
    q = np.array([0.2, -0.5, 0.8, 0.1, 0.9, -0.3])
    tip_in_base = (forward(ARM.dh, q) @ np.append(ARM.tool, 1.0))[:3]
    placed = turn("z", np.radians(30)) @ ARM.tip(q) + [1.2, -0.08, 0.5]
    np.testing.assert_allclose(placed, tip_in_base, atol=1e-12)


def test_time_series_of_poses_are_taken_at_once():
    q = np.random.default_rng(1).uniform(-1, 1, (5, 6))
    one_by_one = np.array([jacobian(ARM.dh, row) for row in q])
    np.testing.assert_allclose(jacobian(ARM.dh, q), one_by_one, atol=1e-14)


def test_a_cell_of_which_nothing_is_known_has_no_arm():
    assert arm_of_cell({"cell": "mystery"}, {"tool_in_flange_mm": TOOL_MM}) is None


def test_the_printed_equation_2_is_no_rotation():
    """[K] eq. 2 has cos θ cos α where sin θ sin α belongs: its axes are not at right angles."""
    theta, alpha = 0.7, 1.1
    (c, s), (ca, sa) = ((np.cos(a), np.sin(a)) for a in (theta, alpha))
    printed = np.array([[c, -s * ca, c * ca], [s, c * ca, -c * sa], [0, sa, ca]])
    ours = link_frames(np.array([[0.0, alpha, 0.3, 0.2]]), np.array([theta]))[1, :3, :3]
    np.testing.assert_allclose(ours.T @ ours, np.eye(3), atol=1e-15)
    assert np.abs(printed.T @ printed - np.eye(3)).max() > 0.1
    np.testing.assert_array_equal(ours[:, :2], printed[:, :2])
