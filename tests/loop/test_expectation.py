"""The compiled step of expectation–maximisation against dense linear algebra."""

from dataclasses import replace

import numpy as np
import pytest
from toy import BETA, POINTS, Wave, block

from metro.loop.fitting.expectation import _expected, _known, _says, _Weights
from metro.loop.fitting.noise import Noise, alike_times, apart, axes, columns, diagonal, shared, sizes


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


def test_the_variance_of_a_run_is_that_by_which_a_fit_weighs_it():
    rng = np.random.default_rng(7)
    one = replace(
        block("r1", 1.0, "identify", rng, phased=False, condition="c"),
        alike=rng.uniform(0.1, 0.3, POINTS),
        scale=rng.uniform(1.0, 2.0, POINTS),
        zeros=np.ones((POINTS, 1)),
        zero_sd=np.array([0.02]),
        repeats=2,
    )
    names, number, rms = axes(one)
    misfit, level = np.full(len(names), 0.05), np.full(len(names), 0.1)
    noise = Noise(
        *(0.01, np.array([0.01, 0.02]), {"c": 3.0}, 1.7, 2.0, 0.4),
        misfit=dict(zip(names, misfit, strict=True)),
        level=dict(zip(names, level, strict=True)),
    )
    matrix, _ = Wave().design(one, np.zeros(0))
    directions = columns(one, noise, matrix, BETA) * sizes(one, noise)
    assert directions == pytest.approx(shared(one, noise, matrix, BETA))
    assert directions[:, -1] == pytest.approx(1.7 * 0.02)
    weights = _Weights(misfit, level, noise.budget, apart(one, noise), alike_times(one, noise))
    found = _says(rng.normal(size=POINTS), directions, _known(one), (rms, number), weights)
    assert found[2] == pytest.approx(diagonal(one, noise), rel=1e-12)
