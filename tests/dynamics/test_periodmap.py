"""The period map without its matrix against the matrix."""

import numpy as np
import pytest

from metro.dynamics.periodmap import PeriodMap, spectral_radius, stacks, unit_radius


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


def crowded(steps):
    """Return a map whose multipliers are 1 − 0.1 (i/steps)², many of them next to the largest, 1.

    What is remembered returns after one period, each place weighed by its own factor.
    """
    factor = 1.0 - 0.1 * (np.arange(steps) / steps) ** 2
    delayed = np.zeros((2, steps, 1, 1, 1))
    delayed[:, :, 0, 0, 0] = factor * np.array([[1.0], [0.5]])
    return PeriodMap(np.zeros((2, steps, 1, 1)), delayed, np.array([steps]), np.ones((1, 1)))


def test_multipliers_of_almost_one_modulus_need_more_vectors():
    np.testing.assert_allclose(spectral_radius(crowded(200)), [1.0, 0.5], rtol=1e-9)


def test_where_it_does_not_converge_the_radius_is_unknown():
    """It was an error, which ended a whole batch at a depth that only a check of methods asked for."""
    assert np.all(np.isnan(spectral_radius(crowded(4000))))


def test_secants_through_what_is_unknown_find_nothing_and_the_others_all():
    def radius(depth):
        return np.where([True, False], np.exp(3.0 * (depth - 1.0)), np.nan)

    found = unit_radius(radius, np.array([1.1, 1.1]))
    assert found[0] == pytest.approx(1.0, rel=1e-6)
    assert np.isnan(found[1])


def test_secants_find_where_the_radius_is_one():
    depths = unit_radius(lambda a: np.exp(3.0 * (a - np.array([1.0, 2.0]))), np.array([1.1, 1.9]))
    np.testing.assert_allclose(depths, [1.0, 2.0], rtol=1e-6)


def test_secants_that_find_nothing_say_so():
    assert np.isnan(unit_radius(lambda a: np.full(1, 0.5) + 0 * a, np.array([1.0]))[0])


def test_rows_are_stacked_with_those_that_need_about_as_many_steps():
    steps = np.array([900, 100, 130, 1000, 199, 201, 40_000, 30_000])
    made = stacks(steps, 2.0)
    assert sorted(np.concatenate(made)) == list(range(8))
    assert [sorted(stack) for stack in made] == [[1, 2, 4], [5], [0, 3], [7], [6]]
