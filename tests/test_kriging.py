"""Values between points where they are known."""

import numpy as np

from metro.kriging import krige

RNG = np.random.default_rng(3)


def smooth(x):
    return np.stack([np.sin(4.0 * x[:, 0]), np.cos(5.0 * x[:, 0]) + 2.0], axis=1)


def test_known_values_come_back_and_are_sure():
    at = RNG.random((12, 2))
    mean, sd = krige(at, smooth(at))(at)
    np.testing.assert_allclose(mean, smooth(at), atol=0.01)
    assert sd.max() < 0.05


def test_errors_between_the_points_are_as_large_as_told():
    at, other = RNG.random((25, 2)), RNG.random((300, 2))
    mean, sd = krige(at, smooth(at))(other)
    error = mean - smooth(other)
    assert np.sqrt(np.mean(error**2)) < 0.1
    assert 0.05 < np.mean(error**2) / np.mean(sd**2) < 4.0


def test_a_coordinate_that_changes_nothing_is_found_to():
    at = RNG.random((25, 2))
    learnt = krige(at, smooth(at))
    assert learnt.lengths[1] > 2.0 * learnt.lengths[0]


def test_far_from_all_points_the_trend_is_told_and_unsure():
    at = 0.05 * RNG.random((10, 1))
    values = RNG.standard_normal((10, 1))
    learnt = krige(at, values)
    mean, sd = learnt(np.array([[50.0]]))
    np.testing.assert_allclose(mean[0], learnt.trend, atol=1e-6)
    np.testing.assert_allclose(sd[0] ** 2, learnt.variance, rtol=1e-6)


def test_values_left_out_are_told_as_without_them():
    """Dubrule's formula against kriging written out without each point, lengths and trend kept."""
    at = RNG.random((12, 2))
    learnt = krige(at, smooth(at))
    error, sd = learnt.left_out()
    covariance = np.linalg.inv(learnt.inverse)
    for i in range(12):
        rest = np.arange(12) != i
        weights = np.linalg.solve(covariance[np.ix_(rest, rest)], covariance[rest, i])
        told = learnt.trend + weights @ (smooth(at)[rest] - learnt.trend)
        np.testing.assert_allclose(error[i], told - smooth(at)[i], atol=1e-8)
        left = covariance[i, i] - weights @ covariance[rest, i]
        np.testing.assert_allclose(sd[i], np.sqrt(left * learnt.variance), rtol=1e-6)


def test_the_trend_is_the_mean_of_least_variance():
    """Weighted by the inverse covariance (generalised least squares), not the plain mean."""
    at = np.random.default_rng(4).random((12, 2)) ** 3
    found = krige(at, np.column_stack([np.exp(2.0 * at[:, 0]), at[:, 1]]))
    weights = found.inverse.sum(axis=0) / found.inverse.sum()
    values = np.column_stack([np.exp(2.0 * at[:, 0]), at[:, 1]])
    np.testing.assert_allclose(found.trend, weights @ values, rtol=1e-6)
    assert np.abs(values.mean(axis=0) - found.trend).max() > 1e-3
