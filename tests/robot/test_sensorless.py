"""Tip forces from joint torques, against the forces that made them."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from kr160_arm import arm_with_tool
from scipy.signal import lfilter

from metro.robot.sensorless import (
    beyond_noise,
    friction_repeatability,
    mean_force,
    noise_of_bins,
    observability,
    smoothed_torque,
    tip_force,
)
from metro.robot.statics import tip_jacobian

ARM = arm_with_tool()
FORCE = np.array([80.0, -170.0, -35.0])


def torques(n):
    """Torques of FORCE in n poses by differences of the tip's position: τ_i = −f·∂x/∂q_i."""
    q = np.array([0.1, -0.9, 1.2, 0.3, 0.8, 0.2]) + np.linspace(0, 0.05, n)[:, None]
    step = 1e-6
    moves = [(ARM.tip(q + step * e) - ARM.tip(q - step * e)) / (2 * step) for e in np.eye(6)]
    return q, -np.stack([move @ FORCE for move in moves], axis=1)


def test_exact_torques_give_the_exact_force_from_any_three_joints():
    q, torque = torques(10)
    for joints in ([0, 1, 2], [0, 3, 4], [1, 4, 5], range(6)):
        index = np.where(np.isin(np.arange(6), list(joints)), 3.0, 0.5)
        found = tip_force(torque, np.ones_like(torque), tip_jacobian(ARM, q), index)
        np.testing.assert_allclose(found.force, np.tile(FORCE, (10, 1)), atol=1e-4)


def test_joints_below_the_index_do_not_count_whatever_they_say():
    q, torque = torques(5)
    torque[:, 1] = 1e6
    index = np.array([3.0, 1.99, 4.0, 2.0, 5.0, 2.5])
    found = tip_force(torque, np.ones_like(torque), tip_jacobian(ARM, q), index)
    np.testing.assert_allclose(found.force, np.tile(FORCE, (5, 1)), atol=1e-4)


def test_the_stated_covariance_is_that_of_the_noise():
    q, torque = torques(4000)
    sd = np.array([3.0, 3.0, 2.0, 1.0, 1.0, 0.5])
    noisy = torque + np.random.default_rng(8).normal(0, sd, torque.shape)
    q = np.broadcast_to(q[:1], q.shape)
    torque = torque + (torque[:1] - torque)
    noisy = torque + np.random.default_rng(8).normal(0, sd, torque.shape)
    found = tip_force(noisy, np.broadcast_to(sd**2, torque.shape), tip_jacobian(ARM, q), np.full(6, 9.0))
    np.testing.assert_allclose(np.cov(found.force.T), found.covariance[0], rtol=0.15, atol=0.3)


def test_joints_that_pull_alike_are_betrayed_by_the_condition_number():
    jacobian = np.array([[1.0, 1.001, 0.0], [0.5, 0.5, 1.0], [0.2, 0.2, 0.0]])[None]
    found = tip_force(np.ones((1, 3)), np.ones((1, 3)), jacobian, np.full(3, 5.0))
    assert found.condition[0] == pytest.approx(np.linalg.cond(jacobian[0]))
    assert found.condition[0] > 1000


def test_the_index_is_the_mean_of_the_cut_over_the_range_of_the_idle_run():
    cutting = np.array([[-4.0, 1.0], [-8.0, -1.0]])
    idle = np.array([[10.0, 5.0], [13.0, 4.5]])
    np.testing.assert_allclose(observability(cutting, idle), [6 / 3, 0.0])


def test_two_joints_are_not_enough():
    q, torque = torques(3)
    with pytest.raises(ValueError, match="only 2 of 6 joints reach the observability index 2; at least 3"):
        tip_force(torque, np.ones_like(torque), tip_jacobian(ARM, q), np.array([3, 1, 1, 1, 9, 0.2]))


def test_a_joint_that_adds_next_to_nothing_is_left_out():
    q, torque = torques(10)
    jacobian = tip_jacobian(ARM, q)
    variance = np.ones_like(torque)
    variance[:, 3] = 1e4
    found = tip_force(torque, variance, jacobian, np.full(6, 9.0))
    assert not found.used[3]

    def error(joints):
        system = np.swapaxes(jacobian[:, :, joints], 1, 2) / np.sqrt(variance[:, joints])[:, :, None]
        information = np.swapaxes(system, 1, 2) @ system
        if np.linalg.cond(information).max() > 1e12:
            return np.inf
        return np.sqrt(np.trace(np.linalg.inv(information), axis1=1, axis2=2).mean())

    used = np.flatnonzero(found.used)
    best = error(np.arange(6))
    assert error(used) <= 1.02 * best
    smaller = [error(np.array(c)) for c in combinations(range(6), len(used) - 1)] if len(used) > 3 else []
    assert all(e > 1.02 * best for e in smaller)
    same = [error(np.array(c)) for c in combinations(range(6), len(used))]
    assert error(used) == pytest.approx(min(same))


def test_three_joints_that_leave_an_axis_open_are_refused():
    jacobian = np.tile(np.array([[1.0, 0.5, 0.3], [0.0, 0.4, 0.1], [0.0, 0.0, 0.0]]), (4, 1, 1))
    with pytest.raises(ValueError, match="joints 1, 2, 3 do not determine all three axes"):
        tip_force(np.ones((4, 3)), np.ones((4, 3)), jacobian, np.full(3, 5.0))


def logged(rng, persistence, walk, shaken):
    """Idle and cut of 8 samples a bin: coloured noise on slow friction, and a force that wanders."""
    bins, per = 100, 8
    sd = np.array([3.0, 3.0, 2.0, 1.0, 1.0, 0.5])
    force = FORCE + np.cumsum(rng.normal(0, walk, (bins, 3)), axis=0)
    torque = -np.einsum("mai,ma->mi", JACOBIAN, force)

    def noise():
        white = rng.normal(size=(bins * per + 200, 6))
        return sd * lfilter([np.sqrt(1 - persistence**2)], [1.0, -persistence], white, axis=0)[200:]

    friction = np.array([10.0, 40, 20, 5, 5, 3]) * np.sin(np.linspace(0, 1.5, bins * per))[:, None]
    return force, friction + shaken * noise() + np.repeat(torque, per, axis=0), friction + noise()


PATH = np.array([0.1, -0.9, 1.2, 0.3, 0.8, 0.2]) + np.linspace(0, 0.05, 100)[:, None]
MOVES = [(ARM.tip(PATH + 1e-6 * e) - ARM.tip(PATH - 1e-6 * e)) / 2e-6 for e in np.eye(6)]
JACOBIAN = np.stack(MOVES, axis=2)


@pytest.mark.parametrize(("persistence", "walk", "shaken"), [(0.5, 2.0, 1.0), (0.7, 0.5, 2.0)])
def test_the_interval_of_the_steady_mean_holds_the_truth_19_times_in_20(persistence, walk, shaken):
    inside, naive = [], []
    steady = np.arange(100) >= 10
    for seed in range(400):
        force, cut, idle = logged(np.random.default_rng(seed), persistence, walk, shaken)
        difference = (cut - idle).reshape(100, 8, 6).mean(axis=1)
        torque = smoothed_torque(difference, noise_of_bins(cut, idle, (8, 8)))
        found = tip_force(torque.level, torque.variance, JACOBIAN, np.full(6, 9.0))
        mean, covariance = mean_force(found, torque, steady)
        error = np.abs(mean - force[steady].mean(axis=0))
        inside.append(error < 1.96 * np.sqrt(np.diag(covariance)))
        sd = np.sqrt(np.einsum("maa->ma", found.covariance))[steady].mean(axis=0)
        naive.append(error < 1.96 * sd)
    assert 0.93 <= np.mean(inside) <= 0.97
    # the error of a single place, taken for that of the mean, always holds it
    assert np.mean(naive) > 0.995


def test_joints_that_leave_an_axis_open_do_not_count_as_enough():
    """Two of the three that pass pull nearly alike: of all joints the force is told far better."""
    passing = [[1.0, 1.0, 0.0], [0.5, 0.5, 1.0], [0.2, 0.21, 0.0]]
    jacobian = np.tile(np.hstack([passing, np.eye(3)]), (4, 1, 1))
    torque = -np.einsum("mai,a->mi", jacobian, FORCE)
    index = np.array([5.0, 5.0, 5.0, 1.0, 1.0, 1.0])
    with pytest.raises(
        ValueError, match=r"joints 1, 2, 3, .* leave an axis of the force open: .* of all joints"
    ):
        tip_force(torque, np.ones((4, 6)), jacobian, index)
    found = tip_force(torque, np.ones((4, 6)), jacobian, index, least=0.0)
    np.testing.assert_allclose(found.force, np.tile(FORCE, (4, 1)), atol=1e-6)


def test_slow_noise_widens_the_interval_of_the_mean_by_what_it_does_to_it():
    """Half of the path is steady: slow waves, which average out over the whole, do not over a half."""
    rng, count, level = np.random.default_rng(12), 100, np.array([4.0, 3.0, 2.0, 1.0, 1.0, 1.0])
    number = np.arange(1, count)
    shapes = np.sqrt(2 / count) * np.cos(np.pi * np.outer(np.arange(count) + 0.5, number) / count)
    steady = np.arange(count) >= count // 2
    white = np.full(6, 1e-6)
    found = tip_force(np.zeros((count, 6)), np.ones((count, 6)), JACOBIAN, np.full(6, 9.0))
    draws = []
    for _ in range(2000):
        slow = shapes @ (rng.normal(size=(count - 1, 6)) * np.sqrt(level / number[:, None]))
        draws.append(np.einsum("mai,mi->ma", found.solve, slow)[steady].mean(axis=0))
    still = smoothed_torque(rng.normal(0.0, 1e-3, (count, 6)), white)
    told = mean_force(found, still, steady, 0.0, level)[1]
    np.testing.assert_allclose(np.diag(told), np.var(draws, axis=0), rtol=0.12)
    assert np.diag(mean_force(found, still, steady)[1]).max() < 1e-3 * np.diag(told).min()


def test_slow_noise_at_a_place_varies_as_its_waves_together():
    rng, count, level = np.random.default_rng(13), 60, np.array([4.0, 1.0])
    number = np.arange(1, count)
    shapes = np.sqrt(2 / count) * np.cos(np.pi * np.outer(np.arange(count) + 0.5, number) / count)
    draws = shapes @ (rng.normal(size=(3000, count - 1, 2)) * np.sqrt(level / number[:, None]))
    told = beyond_noise(np.full((count, 2), 0.5), np.array([0.3, 0.0]), level)
    np.testing.assert_allclose((draws**2).mean(axis=(0, 1)), told[0] - [0.5 + 0.09, 0.5], rtol=0.05)


def test_friction_by_the_air_holds_a_further_run_as_often_as_it_says():
    """The next run's friction lies within 1.96 of it in 95 % of batches, be there two runs or twelve."""
    rng = np.random.default_rng(14)
    for runs in (2, 12):
        air = rng.normal(0.0, np.hypot(3.0, 0.5), (runs, 4000))
        told = friction_repeatability(air, np.full((runs, 4000), 0.25), np.full(4000, 0.01))
        held = np.abs(rng.normal(0.0, 3.0, 4000)) < 1.96 * told
        assert held.mean() == pytest.approx(0.95, abs=0.015)
    assert friction_repeatability(np.zeros((3, 1)), np.ones((3, 1)), np.array([0.3])) == pytest.approx(0.3)
