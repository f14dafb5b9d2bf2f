"""The walk at uneven intervals: exact Gaussian algebra, the even walk's closed forms, and drawn walks."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2, multivariate_normal

from metro.signals import kalman, kalman_uneven
from metro.signals.intervals import UNEVEN

R, Q = np.array([4.0, 1.0]), np.array([0.5, 0.02])


def gaps(count, rng):
    """Intervals of a log that lost a fifth of its samples in holes, and whose clock jitters besides."""
    interval = rng.uniform(0.5, 1.5, count - 1)
    interval[rng.choice(count - 1, count // 20, replace=False)] *= 30.0
    return interval / np.median(interval)


def walk(interval, rng):
    steps = rng.normal(size=(len(interval), 2)) * np.sqrt(interval[:, None] * Q)
    level = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    return level, level + rng.normal(size=level.shape) * np.sqrt(R)


def covariance(interval, channel):
    """Posterior of the levels of one channel, from a prior that starts anywhere."""
    step = np.diff(np.eye(len(interval) + 1), axis=0)
    information = step.T @ (step / (Q[channel] * interval)[:, None])
    return np.linalg.inv(information + np.eye(len(interval) + 1) / R[channel])


def test_at_even_intervals_all_is_that_of_the_closed_forms():
    even = np.ones(299)
    _, z = walk(even, np.random.default_rng(1))
    for own, closed in zip(kalman_uneven.smooth(z, R, Q, even), kalman.smooth(z, R, Q), strict=True):
        np.testing.assert_allclose(own, closed, rtol=1e-6, atol=1e-6)
    trials = np.geomspace(0.01, 100.0, 9)[:, None] * Q
    np.testing.assert_allclose(
        kalman_uneven.log_likelihood(z, R, trials, even), kalman.log_likelihood(z, R, trials), rtol=1e-9
    )
    drift = kalman.likeliest_drift(z, R)
    np.testing.assert_allclose(kalman_uneven.likeliest_drift(z, R, even), drift, rtol=1e-6)
    np.testing.assert_allclose(
        kalman_uneven.innovations(z, R, Q, even), kalman.innovations(z, R, Q), rtol=1e-9
    )
    weights = np.random.default_rng(2).normal(size=(3, 300, 2))
    np.testing.assert_allclose(
        kalman_uneven.combined_covariance(weights, R, Q, even),
        kalman.combined_covariance(weights, R, Q),
        rtol=1e-6,
    )


def test_at_uneven_intervals_all_is_that_of_the_joint_gaussian():
    rng = np.random.default_rng(3)
    interval = gaps(60, rng)
    _, z = walk(interval, rng)
    level, variance = kalman_uneven.smooth(z, R, Q, interval)
    weights, sums = rng.normal(size=(3, 60, 2)), np.zeros((3, 3))
    time = np.concatenate([[0.0], np.cumsum(interval)])
    likelihood = kalman_uneven.log_likelihood(z, R, Q[None], interval)[0]
    for k in range(2):
        exact = covariance(interval, k)
        np.testing.assert_allclose(level[:, k], exact @ z[:, k] / R[k], rtol=1e-8, atol=1e-8)
        np.testing.assert_allclose(variance[:, k], np.diag(exact), rtol=1e-8)
        sums += weights[:, :, k] @ exact @ weights[:, :, k].T
        spread = Q[k] * np.minimum.outer(time[1:], time[1:]) + R[k] * (np.eye(59) + 1)
        joint = multivariate_normal(np.zeros(59), spread).logpdf(z[1:, k] - z[0, k])
        assert likelihood[k] == pytest.approx(joint, abs=1e-8)
    np.testing.assert_allclose(kalman_uneven.combined_covariance(weights, R, Q, interval), sums, rtol=1e-8)


def test_on_gaps_and_jitter_the_error_is_smaller_than_the_closed_forms():
    """Each with its own likeliest drift: beside a gap, the even walk is wrong by more than it says."""
    rng, count = np.random.default_rng(4), 200
    square, beside = np.zeros(2), [[], []]
    for _ in range(60):
        interval = gaps(count, rng)
        level, z = walk(interval, rng)
        ends = np.flatnonzero(interval > 10.0)
        ends = np.concatenate([ends, ends + 1])
        drift = kalman_uneven.likeliest_drift(z, R, interval)
        found = (
            kalman_uneven.smooth(z, R, drift, interval),
            kalman.smooth(z, R, kalman.likeliest_drift(z, R)),
        )
        for way, (levels, variance) in enumerate(found):
            square[way] += ((levels - level) ** 2).sum()
            beside[way].append(((levels - level) ** 2 / variance)[ends].mean())
    assert square[0] < 0.8 * square[1]
    assert np.mean(beside[0]) < 1.2
    assert np.mean(beside[1]) > 1.5


def test_with_the_true_drift_the_whole_error_is_a_chi_square():
    rng, total, count = np.random.default_rng(5), 0.0, 80
    for _ in range(50):
        interval = gaps(count, rng)
        level, z = walk(interval, rng)
        error = kalman_uneven.smooth(z, R, Q, interval)[0] - level
        total += sum(error[:, k] @ np.linalg.solve(covariance(interval, k), error[:, k]) for k in range(2))
    assert 0.01 < chi2.cdf(total, 50 * 2 * count) < 0.99


@pytest.mark.parametrize("ratio", [1e-3, 0.1, 10.0])
def test_intervals_taken_for_even_cost_no_more_of_the_standard_deviation_than_they_differ(ratio):
    """The bound that ``UNEVEN`` rests on, over walks, for the worst sum of levels there is."""
    rng, count = np.random.default_rng(6), 120
    step = np.diff(np.eye(count), axis=0)
    interval = 1.0 + UNEVEN * rng.choice([-1.0, 1.0], count - 1)
    walked = step.T @ (step / (ratio * interval)[:, None])
    right, wrong = (np.linalg.inv(part + np.eye(count)) for part in (walked, step.T @ step / ratio))
    # of the error right − wrong in the measured: its covariance over walks and noise, about a common level
    lower = np.tril(np.ones((count, count - 1)), -1)
    apart = (wrong - right) @ np.column_stack([lower * np.sqrt(ratio * interval), np.eye(count)])
    worst = np.linalg.eigvals(np.linalg.solve(right, apart @ apart.T)).real.max()
    assert 0.1 * UNEVEN < np.sqrt(worst) < 1.15 * UNEVEN


def test_innovations_of_the_walk_are_white_where_those_of_the_even_walk_spread():
    rng = np.random.default_rng(7)
    interval = gaps(3000, rng)
    _, z = walk(interval, rng)
    found = kalman_uneven.innovations(z, R, Q, interval)
    assert found.var() == pytest.approx(1.0, abs=0.05)
    assert (kalman.whiteness(found) > 0.01).all()
    assert kalman.innovations(z, R, Q).var() > 1.1
