"""Joint compliances from load tests, against the compliances that made them."""

from __future__ import annotations

import numpy as np
import pytest
from kr160_arm import arm_with_tool

from metro.robot.statics import joint_contributions
from metro.robot.stiffness import distinguishable, joint_compliances

ARM = arm_with_tool()
TRUE = 1 / np.array([4.6e6, 4.8e6, 3.3e6, 5.2e5, 6.1e5, 3.9e5])


def loads_in(poses, seed=3):
    """Loads of 200 N along ± each axis in poses near a working one: (m, 3, 6), and exact displacements."""
    rng = np.random.default_rng(seed)
    q = np.array([0.2, -0.6, 0.9, 0.4, 0.8, 0.3]) + rng.uniform(-0.5, 0.5, (poses, 1, 6))
    force = 200 * np.concatenate([np.eye(3), -np.eye(3)])[None]
    design = joint_contributions(
        ARM, np.broadcast_to(q, (poses, 6, 6)), np.broadcast_to(force, (poses, 6, 3))
    )
    design = design.reshape(-1, 3, 6)
    return design, design @ TRUE


def test_exact_displacements_give_exact_compliances_whatever_is_blank():
    design, displacement = loads_in(4)
    displacement[::2, 1] = np.nan
    displacement[1::3, 0] = np.nan
    np.testing.assert_allclose(joint_compliances(design, displacement).value, TRUE, rtol=1e-9)


def test_the_stated_covariance_is_that_of_repeated_noisy_tests():
    design, displacement = loads_in(5)
    rng, sigma = np.random.default_rng(4), 4e-6
    fits = [
        joint_compliances(design, displacement + rng.normal(0, sigma, displacement.shape)) for _ in range(300)
    ]
    values = np.array([fit.value for fit in fits])
    stated = np.mean([fit.sd for fit in fits], axis=0)
    np.testing.assert_allclose(values.std(axis=0), stated, rtol=0.12)
    np.testing.assert_allclose(values.mean(axis=0), TRUE, atol=4 * stated.max() / np.sqrt(300))
    assert np.mean([fit.scatter for fit in fits]) == pytest.approx(sigma, rel=0.02)


def test_a_joint_that_no_load_turns_is_said_to_be_unseen_and_leaves_the_others_alone():
    """Forces through the axis of joint 6 do not turn it."""
    no_lever = arm_with_tool(tool_in_flange_mm=[0.0, 0.0, 279.91])
    rng = np.random.default_rng(5)
    q, force = rng.uniform(-1, 1, (30, 6)), rng.normal(0, 150, (30, 3))
    design = joint_contributions(no_lever, q, force)
    fit = joint_compliances(design, design @ TRUE)
    assert list(fit.seen) == [True] * 5 + [False]
    np.testing.assert_allclose(fit.value[:5], TRUE[:5], rtol=1e-8)
    assert fit.value[5] == 0
    assert np.isinf(fit.sd[5])


def test_two_joints_that_always_move_together_are_both_unseen():
    columns = np.random.default_rng(6).normal(size=(20, 4))
    columns[:, 3] = -2 * columns[:, 1]
    assert list(distinguishable(columns)) == [True, False, True, False]


def test_no_compliance_comes_out_negative():
    design, displacement = loads_in(3)
    rng = np.random.default_rng(7)
    for _ in range(20):
        assert (
            joint_compliances(design, displacement + rng.normal(0, 2e-4, displacement.shape)).value >= 0
        ).all()


def test_too_few_displacements_are_refused():
    design, displacement = loads_in(1)
    with pytest.raises(ValueError, match="3 measured displacements cannot separate the joints"):
        joint_compliances(design[:1], displacement[:1])
