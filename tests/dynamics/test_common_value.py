"""What files have in common where they may differ by more than their errors: coverage, drawn from scratch."""

import numpy as np
import pytest

from metro.dynamics.common_value import common_value


def draws(files, between, repeats, seed):
    """Values of files, their errors (of which the largest is five times the smallest), the truth being 0."""
    rng = np.random.default_rng(seed)
    for _ in range(repeats):
        sd = np.exp(rng.uniform(-0.8, 0.8, files))
        yield rng.normal(size=files) * np.hypot(sd, between), sd


@pytest.mark.parametrize("files", [3, 5, 9])
@pytest.mark.parametrize("between", [0.0, 1.0, 10.0])
def test_the_interval_contains_the_truth_as_often_as_it_says(files, between):
    inside = [
        abs(common_value(values, sd).value) < 1.96 * common_value(values, sd).sd
        for values, sd in draws(files, between, 600, files)
    ]
    # 95 %, and nowhere below 88: where the scatter is as large as the errors, few files hardly show it
    assert np.mean(inside) > 0.88


@pytest.mark.parametrize("files", [2, 3, 5, 9])
def test_files_that_agree_have_the_interval_of_their_errors(files):
    ratio = [
        common_value(values, sd).sd * np.sqrt(np.sum(sd**-2.0))
        for values, sd in draws(files, 0.0, 600, files)
    ]
    assert np.median(ratio) < 1.15
    assert np.min(ratio) == pytest.approx(1.0)


def test_files_that_differ_much_have_the_interval_of_a_mean_of_equals():
    """Student's interval of nine values, whatever their small errors are."""
    values = np.random.default_rng(0).normal(size=9)
    found = common_value(values, np.geomspace(1e-6, 1e-4, 9))
    half = 2.306 * values.std(ddof=1) / 3
    assert found.value == pytest.approx(values.mean(), rel=1e-6)
    # the median of chi² with eight degrees of freedom is 7.34
    assert 1.96 * found.sd == pytest.approx(half * np.sqrt(8 / 7.344), rel=1e-3)
    assert found.scatter == pytest.approx(values.std(ddof=1) * np.sqrt(8 / 7.344), rel=1e-3)


def test_one_file_says_nothing_of_others():
    found = common_value(np.array([3.0]), np.array([0.2]))
    assert (found.value, found.sd, found.scatter, found.files) == (3.0, pytest.approx(0.2), 0.0, 1)
    assert found.chance == 1.0


def test_the_probability_of_chance_is_uniform_where_the_files_agree():
    chance = np.array([common_value(values, sd).chance for values, sd in draws(5, 0.0, 600, 1)])
    np.testing.assert_allclose([np.mean(chance < p) for p in (0.1, 0.5, 0.9)], [0.1, 0.5, 0.9], atol=0.06)
