"""The random walk that starts anew between stretches, against exact Gaussian algebra and simulated walks."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from metro.signals.kalman import freedom_of_drift, whiteness
from metro.signals.kalman_stretches import (
    combined_covariance,
    innovations,
    likeliest_drift,
    log_likelihood,
    smooth,
    stretches,
)

R, Q = np.array([4.0, 1.0]), np.array([0.5, 0.02])
FREE = np.zeros(40, dtype=bool)
FREE[10:14] = True


def information(steps_of, interval=None):
    """Inverse covariance of the levels of one channel: noise, and a walk over steps within the stretches."""
    within = ~(FREE[1:] | FREE[:-1])
    steps = np.diff(np.eye(40), axis=0)[within]
    over = np.ones(39) if interval is None else interval
    return np.eye(40) / R[steps_of] + (steps.T / (Q[steps_of] * over[within])) @ steps


def record(seed=1):
    return np.random.default_rng(seed).normal(size=(40, 2)).cumsum(axis=0)


def test_free_samples_are_alone_and_the_others_together():
    free = np.array([False, False, True, True, False, False, False, True])
    assert stretches(free) == (slice(0, 2), slice(2, 3), slice(3, 4), slice(4, 7), slice(7, 8))
    assert stretches(np.zeros(5, dtype=bool)) == (slice(0, 5),)


def test_a_phase_whose_samples_were_lost_parts_the_others_all_the_same():
    assert stretches(np.array([0, 0, 1, 2, 2, 4, 4])) == (slice(0, 2), slice(2, 3), slice(3, 5), slice(5, 7))


@pytest.mark.parametrize("uneven", [False, True])
def test_level_variance_and_covariance_are_those_of_the_joint_gaussian(uneven):
    interval = np.random.default_rng(2).uniform(0.5, 3.0, 39) if uneven else None
    z, parts = record(), stretches(FREE)
    level, variance = smooth(z, R, Q, parts, interval)
    weights = np.random.default_rng(3).normal(size=(3, 40, 2))
    expected = np.zeros((3, 3))
    for k in range(2):
        inverse = np.linalg.inv(information(k, interval))
        np.testing.assert_allclose(level[:, k], inverse @ z[:, k] / R[k], rtol=1e-8, atol=1e-10)
        np.testing.assert_allclose(variance[:, k], np.diag(inverse), rtol=1e-8)
        expected += weights[:, :, k] @ inverse @ weights[:, :, k].T
    np.testing.assert_allclose(combined_covariance(weights, R, Q, parts, interval), expected, rtol=1e-8)
    np.testing.assert_allclose(level[FREE], z[FREE])
    np.testing.assert_allclose(variance[FREE], np.tile(R, (4, 1)))


def test_the_likelihood_is_the_product_of_the_stretches_and_blind_to_what_is_between():
    z, parts = record(), stretches(FREE)
    expected = 0.0
    for part in (slice(0, 10), slice(14, 40)):
        n = part.stop - part.start
        k = np.arange(1, n)
        covariance = Q[0] * np.minimum.outer(k, k) + R[0] * (np.eye(n - 1) + 1)
        expected += multivariate_normal(np.zeros(n - 1), covariance).logpdf(z[part, 0][1:] - z[part, 0][0])
        # given a first sample that is known to R alone, the level of which has no prior
    found = log_likelihood(z, R, Q[None], parts, None)[0, 0]
    assert found == pytest.approx(expected, abs=1e-9)
    z[10:14] += 1000.0
    z[14:] -= 500.0
    assert log_likelihood(z, R, Q[None], parts, None)[0, 0] == pytest.approx(found, abs=1e-7)
    assert len(innovations(z, R, Q, parts)) == 9 + 25


@pytest.mark.parametrize("drift", [0.01, 0.1, 1.0])
@pytest.mark.parametrize("length", [60, 137])
def test_the_whiteness_test_alarms_in_five_of_a_hundred_records_of_the_model(length, drift):
    """Levels that jump by what they like at entry and exit, with the drift fitted to each record."""
    rng, count = np.random.default_rng(length), 3000
    free = np.zeros(length, dtype=bool)
    free[11:18] = free[-26:-19] = True
    level = np.cumsum(rng.normal(0.0, np.sqrt(drift), (length, count)), axis=0)
    level[14:-22] += rng.normal(0.0, 100.0, count)
    z, noise, parts = level + rng.normal(size=(length, count)), np.ones(count), stretches(free)
    found = likeliest_drift(z, noise, parts)
    p = whiteness(innovations(z, noise, found, parts), freedom_of_drift(noise, found))
    assert np.mean(p < 0.05) == pytest.approx(0.05, abs=0.013)  # 3.3 standard errors


def test_one_walk_over_entry_and_exit_is_not_white_and_stretches_are():
    """The cause of the alarms in the logs of cuts: rest, ramp, rest are no walk of one drift."""
    rng, count = np.random.default_rng(4), 400
    x = np.arange(137.0)
    ramp = np.interp(x, [11, 18, 111, 118], [0.0, 1.0, 1.0, 0.0])
    z = 30.0 * ramp[:, None] + rng.normal(0.0, 1.8, (137, count))
    noise = np.full(count, 1.8**2)
    alarms = []
    for free in (np.zeros(137, dtype=bool), ((x > 10) & (x < 19)) | ((x > 110) & (x < 119))):
        parts = stretches(free)
        drift = likeliest_drift(z, noise, parts)
        p = whiteness(innovations(z, noise, drift, parts), freedom_of_drift(noise, drift))
        alarms.append(np.mean(p < 0.05))
    assert alarms[0] > 0.5
    assert alarms[1] == pytest.approx(0.05, abs=0.035)  # 3.2 standard errors
