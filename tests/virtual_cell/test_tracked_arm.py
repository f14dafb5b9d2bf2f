"""The simulated arm under a tracker, against closed forms of a planar arm."""

from __future__ import annotations

import numpy as np
import pytest

from virtual_cell.tracked_arm import TrackedArm, came_from, tracked

LENGTHS = np.array([0.5, 0.3])
# Both axes are level (the first row turns them about x), so that the arm moves in a vertical plane.
ROWS = np.array([[0, np.pi / 2, 0, 0, 0], [0, 0, 0, 0.5, 0], [0, 0, 0, 0.3, 0.0]])
STILL = np.zeros(3)


def arm(**hides):
    return TrackedArm(ROWS, np.zeros(3), np.array([0.0, 4.0, 3.0]), **{"compliance": np.zeros(3), **hides})


def test_a_planar_arm_reaches_where_its_links_add_up_to():
    q = np.array([0.0, 0.7, -0.4])
    angles = np.array([0.7, 0.3])
    place = [LENGTHS @ np.cos(angles), 0.0, LENGTHS @ np.sin(angles)]
    assert arm().point(q, STILL) == pytest.approx(place)


def test_joints_sag_by_the_moments_of_what_hangs_on_them():
    q, compliance = np.array([0.0, 0.4, 0.3]), np.array([0.0, 2e-5, 3e-5])
    upper, lower = 0.6 * 0.5 * np.cos(0.4), 0.5 * np.cos(0.4) + 0.6 * 0.3 * np.cos(0.7)
    torque = -9.81 * np.array([0.0, 4.0 * upper + 3.0 * lower, 3.0 * 0.6 * 0.3 * np.cos(0.7)])
    assert arm(compliance=compliance).true_angles(q, STILL) - q == pytest.approx(compliance * torque)


def test_readings_are_wrong_by_harmonics_and_by_the_way_they_were_approached():
    q, came = np.array([0.1, 0.4, 0.3]), np.array([0.0, 1.0, -1.0])
    off = arm(turned={1: np.array([[1e-4, 0.0], [0.0, 2e-4]])}, lag=np.array([0.0, 5e-5, 5e-5]))
    expected = [0.0, 1e-4 * np.cos(0.4) + 2e-4 * np.sin(0.8) - 5e-5, 5e-5]
    assert off.true_angles(q, came) - q == pytest.approx(expected)


def test_the_arm_grows_drifts_and_leans():
    q, still = np.array([0.0, 0.0, 0.0]), np.array([0.8, 0.0, 0.0])
    assert arm(growth=1e-5).point(q, STILL, 3.0) == pytest.approx(still * (1 + 3e-5))
    assert arm(drift=np.array([0, 2e-4, 0])).point(q, STILL, 0.0, 0.5) == pytest.approx([0.8, 1e-4, 0.0])
    moment = 9.81 * (4.0 * 0.3 + 3.0 * 0.68)  # about y: the outstretched arm goes down
    assert arm(base=1e-6).point(q, STILL) == pytest.approx([0.8, 0.0, -0.8e-6 * moment])


def test_a_tracker_anywhere_keeps_distances_and_adds_its_noise():
    rng = np.random.default_rng(0)
    q = rng.uniform(-1, 1, (400, 3))
    day = np.zeros(400), np.zeros(400)
    seen, noisy = (
        tracked(arm(), q, day, np.full(400, sigma), np.random.default_rng(1)) for sigma in (0.0, 3e-5)
    )
    true = np.array([arm().point(each, STILL) for each in q])
    apart = [np.linalg.norm(points[:, None] - points, axis=2) for points in (seen, true)]
    assert np.allclose(*apart, atol=1e-12)
    assert np.std(noisy - seen) == pytest.approx(3e-5, rel=0.1)


def test_a_joint_keeps_the_direction_of_its_last_motion():
    q = np.array([[0.0, 1.0], [0.1, 1.0], [0.1, 0.9], [0.0, 0.9]])
    assert came_from(q).tolist() == [[0, 0], [1, 0], [1, -1], [-1, -1]]
