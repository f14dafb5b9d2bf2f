"""The random-walk filter against exact Gaussian algebra and simulated walks."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from metro.signals.kalman import likeliest_drift, log_likelihood, noise_variance, smooth


def walk(n, r, q, seed):
    rng = np.random.default_rng(seed)
    level = np.cumsum(rng.normal(0, np.sqrt(q), (n, len(q))), axis=0)
    return level, level + rng.normal(0, np.sqrt(r), (n, len(r)))


def test_smoothing_is_the_conditional_mean_of_the_joint_gaussian():
    r, q, n = 4.0, 0.5, 30
    _, z = walk(n, np.array([r]), np.array([q]), 1)
    # prior of the levels: a walk that starts anywhere; normal equations of both
    step = np.diff(np.eye(n), axis=0)
    information = np.eye(n) / r + step.T @ step / q
    level, variance = smooth(z, np.array([r]), np.array([q]))
    np.testing.assert_allclose(level[:, 0], np.linalg.solve(information, z[:, 0] / r), rtol=1e-9)
    np.testing.assert_allclose(variance[:, 0], np.diag(np.linalg.inv(information)), rtol=1e-9)


def test_the_likelihood_is_that_of_the_differences_from_the_first_sample():
    r, q, n = 2.0, 0.3, 12
    _, z = walk(n, np.array([r]), np.array([q]), 2)
    k = np.arange(1, n)
    covariance = q * np.minimum.outer(k, k) + r * (np.eye(n - 1) + 1)
    exact = multivariate_normal(np.zeros(n - 1), covariance).logpdf(z[1:, 0] - z[0, 0])
    found = log_likelihood(z, np.array([r]), np.array([[q]]))[0, 0] - 0.5 * (n - 1) * np.log(2 * np.pi)
    assert found + 0.5 * (n - 1) * np.log(2 * np.pi) - exact == pytest.approx(0.0, abs=1e-9)


def test_maximum_likelihood_finds_the_drift_of_simulated_walks():
    r, q = np.array([9.0, 1.0, 0.25]), np.array([0.09, 0.4, 2.0])
    found = np.array([likeliest_drift(walk(400, r, q, seed)[1], r) for seed in range(40)])
    np.testing.assert_allclose(found.mean(axis=0), q, rtol=0.15)


def test_a_finer_search_does_not_find_a_likelier_drift():
    r, q = np.array([1.0]), np.array([0.2])
    _, z = walk(300, r, q, 3)
    best = likeliest_drift(z, r)
    around = best * np.linspace(0.5, 2.0, 301)[:, None]
    fine = around[np.argmax(log_likelihood(z, r, around)[:, 0]), 0]
    assert best[0] == pytest.approx(fine, rel=0.03)


def test_a_constant_in_noise_is_averaged_and_a_clean_signal_left_as_it_is():
    rng = np.random.default_rng(4)
    constant = 5 + rng.normal(0, 1, (500, 1))
    level, variance = smooth(constant, np.ones(1), likeliest_drift(constant, np.ones(1)))
    assert np.abs(level - 5).max() < 0.5
    clean = np.sin(np.linspace(0, 6, 200))[:, None]
    level, _ = smooth(clean, np.full(1, 1e-6), likeliest_drift(clean, np.full(1, 1e-6)))
    np.testing.assert_allclose(level, clean, atol=3e-3)
    assert (variance < 1.0).all()


def test_noise_is_told_from_a_smooth_signal_under_it():
    rng = np.random.default_rng(5)
    smooth_part = 300 * np.sin(np.linspace(0, 4, 2000))[:, None]
    noisy = smooth_part + rng.normal(0, [3.0, 0.5], (2000, 2))
    np.testing.assert_allclose(noise_variance(noisy), [9.0, 0.25], rtol=0.1)
