"""The random-walk filter against exact Gaussian algebra and simulated walks."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2, multivariate_normal

from metro.signals.kalman import (
    combined_covariance,
    freedom_of_drift,
    innovations,
    likeliest_drift,
    log_likelihood,
    long_run_variance,
    noise_variance,
    smooth,
    whiteness,
)


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


@pytest.fixture(scope="module")
def local_level():
    """Return the same walk by statsmodels' local level, its start unknown."""
    structural = pytest.importorskip("statsmodels.tsa.statespace.structural", reason="statsmodels is missing")

    r, q = 4.0, 0.5
    _, z = walk(300, np.array([r]), np.array([q]), 6)
    model = structural.UnobservedComponents(z[:, 0], "llevel", use_exact_diffuse=True)
    return z, np.array([r]), np.array([q]), model


def test_level_variance_likelihood_and_innovations_are_those_of_an_independent_filter(local_level):
    z, r, q, model = local_level
    told = model.smooth([r[0], q[0]])
    level, variance = smooth(z, r, q)
    np.testing.assert_allclose(level[:, 0], told.smoothed_state[0], atol=1e-8)
    np.testing.assert_allclose(variance[:, 0], told.smoothed_state_cov[0, 0], rtol=1e-9)
    own = log_likelihood(z, r, q[None])[0, 0]
    # statsmodels drops the first sample's likelihood, but not its constant
    assert own == pytest.approx(told.llf + 0.5 * np.log(2 * np.pi), abs=1e-6)
    forecast = told.filter_results.standardized_forecasts_error[0, 1:]
    np.testing.assert_allclose(innovations(z, r, q)[:, 0], forecast, atol=1e-8)


def test_the_likeliest_drift_is_that_of_an_independent_optimiser(local_level):
    from scipy.optimize import minimize_scalar

    z, r, _, model = local_level
    best = minimize_scalar(
        lambda log_q: -model.loglike([r[0], np.exp(log_q)]), bounds=(-6, 4), method="bounded"
    )
    assert likeliest_drift(z, r)[0] == pytest.approx(np.exp(best.x), rel=0.02)


def test_smoothing_is_that_of_filterpy():
    from filterpy.kalman import KalmanFilter

    r, q = 2.0, 0.05
    _, z = walk(120, np.array([r]), np.array([q]), 7)
    one = KalmanFilter(dim_x=1, dim_z=1)
    one.F = one.H = np.eye(1)
    one.R, one.Q, one.x, one.P = np.array([[r]]), np.array([[q]]), z[:1].copy(), np.array([[r]])
    mean, covariance, _, _ = one.batch_filter(z[1:])
    mean = np.concatenate([z[:1, None], mean])
    mean, covariance, _, _ = one.rts_smoother(mean, np.concatenate([[[[r]]], covariance]))
    level, variance = smooth(z, np.array([r]), np.array([q]))
    np.testing.assert_allclose(level[:, 0], mean[:, 0, 0], rtol=1e-9)
    np.testing.assert_allclose(variance[:, 0], covariance[:, 0, 0], rtol=1e-9)


def test_a_nearly_constant_level_keeps_its_variance_to_all_digits():
    _, variance = smooth(np.zeros((50, 1)), np.ones(1), np.full(1, 1e-12))
    np.testing.assert_allclose(variance, 1 / 50, rtol=1e-6)


def test_the_error_of_a_mean_of_levels_is_that_of_the_inverse_information_matrix():
    r, q, n = np.array([4.0, 1.0]), np.array([0.5, 0.02]), 40
    weights = np.random.default_rng(8).normal(size=(3, n, 2))
    step = np.diff(np.eye(n), axis=0)
    expected = np.zeros((3, 3))
    for k in range(2):
        inverse = np.linalg.inv(np.eye(n) / r[k] + step.T @ step / q[k])
        expected += weights[:, :, k] @ inverse @ weights[:, :, k].T
    np.testing.assert_allclose(combined_covariance(weights, r, q), expected, rtol=1e-9)


def test_the_whiteness_test_is_that_of_li_and_mcleod_on_the_freedom_that_the_fit_leaves():
    stattools = pytest.importorskip("statsmodels.tsa.stattools", reason="statsmodels is missing")

    found = np.random.default_rng(9).normal(size=(200, 2))
    found -= found.mean(axis=0)  # statsmodels takes the mean off
    r = np.stack([stattools.acf(channel, nlags=10, fft=False)[1:] for channel in found.T], axis=1)
    statistic = 202 * (r**2).sum(axis=0) + 10 * 11 / 400
    for fitted in (0.0, 0.7):
        np.testing.assert_allclose(whiteness(found, fitted), chi2.sf(statistic, 10 - fitted), rtol=1e-9)
    assert np.isnan(whiteness(found[:2])).all()


def test_the_freedom_of_the_drift_is_the_share_of_the_autocorrelations_in_its_information():
    """By numerical derivatives: of the autocorrelations that a wrong drift leaves, and of the likelihood."""
    r, q, step = 1.0, 0.3, 1e-4

    def kernel(ratio):
        """Coefficient λ of the steps, and their variance, from the autocovariances q + 2r and −r."""
        root = np.roots([1.0, -(2.0 + ratio), 1.0]).min()
        return root, r / root

    (near, size), (far, _) = kernel(q), kernel(q + step)
    h = np.arange(1, 11)
    left = ((far - near) * near ** (h - 1)) / step  # (1 − λ'B)⁻¹(1 − λB): residual correlations of a wrong λ
    change = (np.log(kernel(q + step)[1]) - np.log(size)) / step
    whole = ((far - near) / step) ** 2 / (1 - near**2) + 0.5 * change**2
    expected = (left**2).sum() / whole
    assert freedom_of_drift(np.ones(1), np.array([q]))[0] == pytest.approx(expected, rel=1e-3)
    assert freedom_of_drift(np.ones(1), np.array([1e4]))[0] < 1e-6


def test_innovations_of_the_model_are_white_and_those_of_a_wrong_noise_are_not():
    r, q = np.array([4.0]), np.array([0.5])
    right, wrong = [], []
    for seed in range(200):
        _, z = walk(150, r, q, seed)
        for noise, found in ((r, right), (0.05 * r, wrong)):
            drift = likeliest_drift(z, noise)
            found.append(whiteness(innovations(z, noise, drift), freedom_of_drift(noise, drift))[0])
    assert 0.01 <= np.mean(np.array(right) < 0.05) <= 0.10
    assert np.mean(np.array(wrong) < 0.05) > 0.8


@pytest.mark.parametrize("persistence", [0.0, 0.4, 0.7])
def test_the_long_run_variance_of_coloured_noise_on_a_slow_channel(persistence):
    from scipy.signal import lfilter

    rng = np.random.default_rng(10)
    found = []
    for _ in range(60):
        noise = lfilter([1.0], [1.0, -persistence], rng.normal(0, 2.0, (1100, 2)), axis=0)[200:]
        slow = np.array([30.0, -80.0]) * np.sin(np.linspace(0, 2, 900))[:, None]
        found.append(long_run_variance(noise + slow))
    # spectral density of the autoregression at zero frequency
    np.testing.assert_allclose(np.mean(found, axis=0), (2.0 / (1 - persistence)) ** 2, rtol=0.08)


def test_gaps_and_jitter_are_no_noise():
    """A slow channel jumps from one side of a gap to the other: that is no noise."""
    rng = np.random.default_rng(11)
    interval = rng.uniform(0.6, 1.4, 1999)
    interval[rng.choice(1999, 25, replace=False)] = 60.0
    interval /= np.median(interval)
    time = np.concatenate([[0.0], np.cumsum(interval)])
    slow = np.array([2000.0, 30.0]) * np.sin(2.0 * time / time[-1])[:, None]
    noisy = slow + rng.normal(0, [3.0, 0.5], (2000, 2))
    np.testing.assert_allclose(noise_variance(noisy, interval), [9.0, 0.25], rtol=0.1)
    np.testing.assert_allclose(long_run_variance(noisy, interval=interval), [9.0, 0.25], rtol=0.15)
    assert noise_variance(noisy)[0] > 1.3 * 9.0
    assert long_run_variance(noisy)[0] > 3.0 * 9.0


def test_at_even_intervals_the_noise_is_that_of_the_second_differences():
    z = np.random.default_rng(12).normal(size=(100, 2))
    np.testing.assert_allclose(noise_variance(z, np.ones(99)), noise_variance(z), rtol=1e-12)
