"""The fits of the loop on NIST's statistical reference datasets."""

import numpy as np
import pytest
import strd

from metro.loop.fitting.least_squares import least_squares

EVERY = [
    *("Bennett5", "BoxBOD", "Chwirut1", "Chwirut2", "DanWood", "ENSO", "Eckerle4"),
    *("Gauss1", "Gauss2", "Gauss3", "Hahn1", "Kirby2", "Lanczos2", "Lanczos3"),
    *("MGH09", "MGH10", "MGH17", "Misra1a", "Misra1b", "Misra1c", "Misra1d"),
    *("Nelson", "Rat42", "Rat43", "Roszman1", "Thurber"),
]
# from the first start, which is far off
REFUSED = {"BoxBOD", "Eckerle4", "MGH10", "MGH17"}
there = pytest.mark.skipif(
    not (strd.REAL / "strd-nonlinear").is_dir(), reason="real data (METRO_REAL_DATA) are not there"
)


@pytest.mark.parametrize("name", strd.LINEAR[2:7])
def test_linear_sets_of_wampler_come_out_to_nine_digits(name):
    assert strd.reached(strd.linear(name)).digits >= 9


@there
@pytest.mark.parametrize(("name", "digits"), [("pontius", 12), ("longley", 12), ("filip", 7)])
def test_linear_sets_come_out_to_the_digits_that_double_precision_allows(name, digits):
    assert strd.reached(strd.linear(name)).digits >= digits


@there
@pytest.mark.parametrize("name", EVERY)
def test_a_nonlinear_set_comes_out_to_nine_digits_or_is_refused(name):
    problem = strd.nonlinear(name)
    ends = [strd.reached(problem, start) for start in problem.starts]
    assert all(end.digits >= 9 for end in ends if end.usable)
    assert all(end.usable for end in ends[name in REFUSED :])


def test_columns_of_any_unit_and_order_give_the_same_least_squares():
    rng = np.random.default_rng(4)
    columns, target = rng.normal(size=(40, 4)), rng.normal(size=40)
    units, order = np.array([1e-12, 1.0, 1e9, 1e3]), rng.permutation(40)
    plain = least_squares(columns, target)
    np.testing.assert_allclose(plain, np.linalg.lstsq(columns, target, rcond=None)[0], rtol=1e-12)
    np.testing.assert_allclose(least_squares(columns * units, target) * units, plain, rtol=1e-13)
    np.testing.assert_allclose(least_squares(columns[order], target[order]), plain, rtol=1e-13)


def test_a_column_that_is_zero_or_stands_twice_gets_the_shortest_solution():
    rng = np.random.default_rng(5)
    one, target = rng.normal(size=(20, 1)), rng.normal(size=20)
    found = least_squares(np.hstack([one, one, 0 * one]), target)
    half = 0.5 * (one[:, 0] @ target) / (one[:, 0] @ one[:, 0])
    np.testing.assert_allclose(found, [half, half, 0.0], atol=1e-12)


def test_without_columns_there_is_nothing_to_solve():
    assert least_squares(np.zeros((5, 0)), np.ones(5)).shape == (0,)
