"""What load tests tell of the joints, against brute force and geometry."""

from __future__ import annotations

import numpy as np
import pytest
from kr160_arm import arm_with_tool

from metro.robot import identifiability
from metro.robot.statics import joint_contributions
from metro.robot.stiffness import joint_compliances

ARM = arm_with_tool()
TRUE = 1 / np.array([1.8e6, 2.1e6, 1.3e6, 3.1e5, 3.9e5, 2.3e5])
NEAR = np.radians([-20.3, -13.9, -4.4, -61.7, 34.9, 56.7])
TURNING = np.zeros(6, dtype=bool)
SIGMA = 5e-6
FORCES = 300 * np.eye(3)


def loads_of(poses, force=FORCES, arm=ARM):
    """Contributions (m, 3, 6) of every force in every pose, all components read."""
    q = np.repeat(poses, len(force), axis=0)
    rows = joint_contributions(arm, q, np.tile(force, (len(poses), 1)))
    return rows, np.ones((len(rows), 3), dtype=bool)


def some_poses(count, seed=0):
    return NEAR + np.random.default_rng(seed).uniform(-0.5, 0.5, (count, 6))


def test_the_relative_deviation_is_that_of_repeated_noisy_tests():
    rows, measured = loads_of(some_poses(4))
    rng = np.random.default_rng(1)
    fits = [
        joint_compliances(rows, rows @ TRUE + SIGMA * rng.normal(size=measured.shape)) for _ in range(400)
    ]
    found = identifiability.assess(identifiability.information(rows, measured, SIGMA, TRUE))
    spread = np.std([fit.value for fit in fits], axis=0) / TRUE
    np.testing.assert_allclose(found.relative, spread, rtol=0.12)
    assert found.worst == int(np.argmax(spread))
    assert len(found.unseen) == 0


def test_a_joint_whose_axis_every_force_passes_is_the_unseen_direction():
    no_lever = arm_with_tool(tool_in_flange_mm=[0.0, 0.0, 279.91])
    rows, measured = loads_of(some_poses(3), arm=no_lever)
    found = identifiability.assess(identifiability.information(rows, measured, SIGMA, TRUE))
    np.testing.assert_allclose(np.abs(found.unseen), [[0, 0, 0, 0, 0, 1]], atol=1e-5)
    assert np.isinf(found.relative[5])
    assert np.isfinite(found.relative[:5]).all()
    assert found.worst == 5
    assert np.isinf(found.condition)


def test_one_force_in_one_pose_tells_three_combinations_and_no_joint():
    rows, measured = loads_of(some_poses(1), force=np.array([[300.0, -100.0, 50.0]]))
    found = identifiability.assess(identifiability.information(rows, measured, SIGMA, TRUE))
    assert len(found.unseen) == 3
    assert np.isinf(found.relative).all()
    # a change of the compliances along an unseen direction moves no reading
    np.testing.assert_allclose(rows @ (found.unseen * TRUE).T, 0.0, atol=1e-3 * np.abs(rows @ TRUE).max())


def test_components_that_were_not_read_tell_nothing_and_errors_weigh():
    rows, measured = loads_of(some_poses(3))
    rng = np.random.default_rng(2)
    measured &= rng.uniform(size=measured.shape) < 0.7
    sigma = rng.uniform(2e-6, 2e-5, measured.shape)
    expected = np.zeros((6, 6))
    for i, j in zip(*np.nonzero(measured), strict=True):
        expected += np.outer(rows[i, j], rows[i, j]) / sigma[i, j] ** 2 * np.outer(TRUE, TRUE)
    found = identifiability.information(rows, measured, sigma, TRUE)
    np.testing.assert_allclose(found, expected, rtol=1e-10)


def test_repeats_halve_the_variance():
    rows, measured = loads_of(some_poses(3))
    once = identifiability.information(rows, measured, SIGMA, TRUE)
    twice = identifiability.information(np.vstack([rows, rows]), np.vstack([measured, measured]), SIGMA, TRUE)
    one, two = identifiability.assess(once), identifiability.assess(twice)
    np.testing.assert_allclose(two.relative, one.relative / np.sqrt(2))


def test_the_next_load_is_the_best_for_the_worst_joint_of_all_that_could_be_made():
    rows, measured = loads_of(some_poses(2), force=300 * np.eye(3)[:2])
    matrix = identifiability.information(rows, measured, SIGMA, TRUE)
    poses = identifiability.around(NEAR[None], TURNING)
    found = identifiability.next_load(ARM, matrix, poses, newton=300.0, sigma=SIGMA, size=TRUE)
    before = np.linalg.inv(matrix + np.eye(6))
    assert found.joint == int(np.argmax(np.diag(before)))
    assert found.before == pytest.approx(np.sqrt(before[found.joint, found.joint]))
    after = []
    for q in poses:
        for way in identifiability.directions():
            extra = joint_contributions(ARM, q, 300 * way) * TRUE / SIGMA
            after.append(np.linalg.inv(matrix + np.eye(6) + extra.T @ extra)[found.joint, found.joint])
    assert found.after**2 <= 1.1 * min(after) * (1 + 1e-9)
    assert found.after < found.before
    made = joint_contributions(ARM, found.joints, found.force) * TRUE / SIGMA
    again = np.linalg.inv(matrix + np.eye(6) + made.T @ made)
    assert np.sqrt(again[found.joint, found.joint]) == pytest.approx(found.after)


def test_a_joint_that_was_not_seen_is_seen_by_the_load_that_is_proposed():
    axis = 5
    q = some_poses(4, seed=3)
    columns = joint_contributions(ARM, q, np.zeros((4, 3)))  # shape only
    assert columns.shape == (4, 3, 6)
    from metro.robot.statics import tip_jacobian

    through = np.cross(tip_jacobian(ARM, q)[..., axis], [0.3, 0.5, -0.8])
    rows = joint_contributions(ARM, q, 300 * through / np.linalg.norm(through, axis=1)[:, None])
    matrix = identifiability.information(rows, np.ones((4, 3), dtype=bool), SIGMA, TRUE)
    assert np.isinf(identifiability.assess(matrix).relative[axis])
    found = identifiability.next_load(
        ARM, matrix, identifiability.around(q[:1], TURNING), newton=300.0, sigma=SIGMA, size=TRUE
    )
    assert found.joint == axis
    assert found.before == pytest.approx(1.0, rel=1e-3)
    assert found.after < 0.2


def test_poses_around_one_turn_each_joint_both_ways():
    found = identifiability.around(NEAR[None], TURNING)
    assert found.shape == (13, 6)
    moved = found - NEAR
    assert (np.count_nonzero(moved, axis=1) <= 1).all()
    np.testing.assert_allclose(moved.max(axis=0), np.radians(30.0))
    np.testing.assert_allclose(moved.min(axis=0), -np.radians(30.0))


def test_a_linear_axis_is_shifted_and_not_turned():
    moved = identifiability.around(NEAR[None], np.arange(6) == 0) - NEAR
    np.testing.assert_allclose(np.abs(moved).max(axis=0), [0.5, *[np.radians(30.0)] * 5])
