"""Rankings: closed forms for two configurations, brute force over all orders, published formulas."""

import itertools
import math

import numpy as np
import pytest
from scipy import stats

from metro.surface.ranking import agreement, posterior_draws, probability_best, spearman


@pytest.mark.parametrize("dof", [3.0, 8.0, math.inf])
def test_the_better_of_two_is_so_with_the_probability_of_students_t(dof):
    mean, covariance = np.array([5.0, 5.2]), np.array([[0.02, 0.005], [0.005, 0.03]])
    best = probability_best(posterior_draws(mean, covariance, dof, draws=200_000))
    sd = math.sqrt(0.02 + 0.03 - 2 * 0.005)
    expected = stats.t.cdf(0.2 / sd, dof) if math.isfinite(dof) else stats.norm.cdf(0.2 / sd)
    assert best[0] == pytest.approx(expected, abs=0.005)
    assert best.sum() == pytest.approx(1.0)


def test_equal_means_are_best_equally_often():
    best = probability_best(posterior_draws(np.zeros(4), np.eye(4), 6, draws=40_000))
    assert best == pytest.approx(np.full(4, 0.25), abs=0.01)


def test_draws_are_the_same_for_the_same_seed():
    one, same, other = (posterior_draws(np.zeros(3), np.eye(3), 5, 10, seed) for seed in (1, 1, 2))
    assert (one == same).all()
    assert not (one == other).any()


def test_rank_correlation_is_that_of_scipy_with_ties():
    a, b = np.array([1.0, 2.0, 2.0, 5.0, 4.0]), np.array([3.0, 1.0, 4.0, 9.0, 9.0])
    assert spearman(a, b) == pytest.approx(stats.spearmanr(a, b).statistic)


def test_pairs_ranked_alike_are_those_of_kendall():
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=8), rng.normal(size=8)
    found = agreement(a, b)
    assert found.alike == pytest.approx((1 + stats.kendalltau(a, b).statistic) / 2)
    assert found.pairs == 28


def test_the_chance_of_agreeing_as_well_is_counted_over_all_orders():
    a, b = np.arange(5.0), np.array([0.0, 2.0, 1.0, 3.0, 4.0])
    found = agreement(a, b)
    rho = [stats.spearmanr(a, order).statistic for order in itertools.permutations(b)]
    assert found.p_value == pytest.approx(np.mean(np.array(rho) >= found.spearman - 1e-9))
    assert agreement(np.arange(8.0), np.arange(8.0)).p_value < 0.002


def test_the_interval_of_bonett_and_wright_covers_the_correlation_of_the_population():
    rng = np.random.default_rng(2)
    pearson = 0.6
    truth = 6 / math.pi * math.asin(pearson / 2)
    inside = 0
    for _ in range(300):
        pair = rng.multivariate_normal([0, 0], [[1, pearson], [pearson, 1]], 20)
        low, high = agreement(*pair.T).interval
        inside += low <= truth <= high
    assert stats.binomtest(inside, 300, 0.95).pvalue > 0.005


def test_without_draws_the_interval_is_that_of_bonett_and_wright():
    found = agreement(np.arange(5.0), np.array([0.0, 2.0, 1.0, 3.0, 4.0]))
    assert found.spearman == pytest.approx(0.9)
    half = 1.96 * math.sqrt((1 + 0.9**2 / 2) / (5 - 3))  # equation 2 of the paper
    assert found.interval == pytest.approx(
        tuple(math.tanh(math.atanh(0.9) + side * half) for side in (-1, 1)), abs=1e-4
    )


def test_an_order_that_the_runs_leave_open_widens_the_interval():
    predicted = measured = np.array([1.0, 1.1, 2.0, 3.0])
    close, wide = (
        agreement(predicted, measured, posterior_draws(measured, sd**2 * np.eye(4), 50)) for sd in (1e-4, 0.5)
    )
    assert close.interval == (1.0, 1.0)
    assert (close.sure_pairs, close.sure_alike) == (6, 1.0)
    assert wide.interval[0] < 0.5
    assert wide.sure_pairs < 4
    falling = agreement(-predicted, -measured, posterior_draws(-measured, 1e-8 * np.eye(4), 50))
    assert (falling.sure_pairs, falling.sure_alike) == (6, 1.0)


def test_a_wrong_order_of_a_sure_pair_is_counted():
    measured = np.array([1.0, 1.001, 3.0])
    found = agreement(np.array([2.0, 3.0, 1.0]), measured, posterior_draws(measured, 0.01 * np.eye(3), 50))
    assert found.sure_pairs == 2
    assert found.sure_alike == 0.0
    assert found.alike == pytest.approx(1 / 3)
