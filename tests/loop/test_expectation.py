"""The compiled step of expectation–maximisation against dense linear algebra."""

import numpy as np
import pytest

from metro.loop.fitting.expectation import _expected


def test_what_a_run_says_of_its_noise_is_what_dense_algebra_says():
    rng = np.random.default_rng(4)
    directions = rng.normal(size=(30, 3)) @ np.array([[1.0, 0.9, 0.0], [0.0, 0.4, 0.5], [0.0, 0.0, 0.3]])
    residual, known = rng.normal(size=30), rng.uniform(0.5, 2.0, 30)
    once, variance, rms = 1.3 * known, 4.0 * known, rng.uniform(1.0, 3.0, 30)
    number = np.arange(30) % 2
    expected, left, moments = _expected(residual, directions, (known, once, variance), rms, number)

    def posterior(diagonal):
        covariance = np.linalg.inv(np.eye(3) + directions.T @ np.diag(1.0 / diagonal) @ directions)
        return covariance @ directions.T @ (residual / diagonal), covariance

    mean, covariance = posterior(variance)
    assert expected == pytest.approx(mean**2 + np.diag(covariance))
    mean, covariance = posterior(once)
    assert left == pytest.approx(residual - directions @ mean)
    excess = left**2 + np.diag(directions @ covariance @ directions.T) - known
    kinds = np.stack([rms**2, np.ones(30)]) / variance
    for axis in (0, 1):
        at = number == axis
        normal = kinds[:, at] @ np.vstack([kinds, excess / variance])[:, at].T
        assert moments[axis] == pytest.approx(normal)
