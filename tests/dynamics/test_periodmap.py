"""The period map without its matrix against the matrix."""

import numpy as np
import pytest

from metro.dynamics.periodmap import PeriodMap, spectral_radius, unit_radius


def some_map(seed, k=3, steps=9, lags=(3, 5)):
    rng = np.random.default_rng(seed)
    state = np.eye(4) + 0.2 * rng.normal(size=(k, steps, 4, 4))
    delayed = 0.3 * rng.normal(size=(k, steps, len(lags), 4, 2))
    return PeriodMap(state, delayed, np.array(lags), rng.normal(size=(2, 4)))


def dense(one, speed):
    """Product of the step matrices on the state and all remembered displacements."""
    n, oldest = 4, int(one.lags.max())
    total = np.eye(n + 2 * oldest)
    for i in range(one.state.shape[1]):
        step = np.zeros_like(total)
        step[:n, :n] = one.state[speed, i]
        for q, lag in enumerate(one.lags):
            step[:n, n + 2 * (lag - 1) : n + 2 * lag] += one.delayed[speed, i, q]
        step[n : n + 2] = one.out @ step[:n]
        step[n + 2 :, n:-2] += np.eye(2 * (oldest - 1))
        total = step @ total
    return total


@pytest.mark.parametrize("lags", [(1,), (3, 5), (2, 9), (4, 14)])
def test_it_is_the_product_of_its_steps(lags):
    one = some_map(0, lags=lags)
    start = np.random.default_rng(1).normal(size=(3, one.size))
    expected = np.stack([dense(one, i) @ start[i] for i in range(3)])
    np.testing.assert_allclose(one.apply(start), expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_the_largest_multiplier_is_that_of_the_matrix(seed):
    one = some_map(seed)
    expected = [np.abs(np.linalg.eigvals(dense(one, i))).max() for i in range(3)]
    np.testing.assert_allclose(spectral_radius(one), expected, rtol=1e-8)


def test_secants_find_where_the_radius_is_one():
    depths = unit_radius(lambda a: np.exp(3.0 * (a - np.array([1.0, 2.0]))), np.array([1.1, 1.9]))
    np.testing.assert_allclose(depths, [1.0, 2.0], rtol=1e-6)


def test_secants_that_find_nothing_say_so():
    assert np.isnan(unit_radius(lambda a: np.full(1, 0.5) + 0 * a, np.array([1.0]))[0])
