"""What is left to gain on NIST's reference data: the digits that the data allow, and the far starts."""

import numpy as np
import pytest
import strd
from strd_exact import exact_least_squares

from metro.loop.fitting.least_squares import least_squares

there = pytest.mark.skipif(
    not (strd.REAL / "strd-nonlinear").is_dir(), reason="real data (METRO_REAL_DATA) are not there"
)


@there
@pytest.mark.parametrize("name", strd.LINEAR)
def test_least_squares_are_the_exact_ones_of_the_columns_given_to_nine_digits(name):
    problem = strd.linear(name)
    exact = exact_least_squares(problem.function, problem.y)
    assert strd.agreeing(least_squares(problem.function, problem.y), exact) >= 9
    assert strd.agreeing(exact, problem.value) >= (7 if name == "filip" else 13)


@there
def test_rounded_powers_of_filip_allow_no_nine_digits_and_the_fit_says_so():
    problem = strd.linear("filip")
    assert strd.agreeing(exact_least_squares(problem.function, problem.y), problem.value) < 8
    assert not strd.reached(problem).usable


@there
def test_longley_is_determined_deviations_and_all():
    end = strd.reached(strd.linear("longley"))
    assert end.usable
    assert min(end.digits, end.sd_digits) >= 7
    assert end.condition == pytest.approx(4.3275e4, rel=1e-4)  # of scaled columns, numpy.linalg.cond


@there
@pytest.mark.parametrize("name", ["Bennett5", "Misra1a", "Nelson", "Rat42"])
def test_starts_from_which_no_share_of_a_step_leads_down_lead_down_damped(name):
    problem = strd.nonlinear(name)
    ends = [strd.reached(problem, start) for start in problem.starts]
    assert all(end.usable for end in ends)
    assert min(end.digits for end in ends) >= 9


def test_fractions_solve_what_is_solved_by_hand():
    found = exact_least_squares(np.array([[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]]), np.array([1.0, 2.0, 4.0]))
    assert found.tolist() == pytest.approx([5 / 6, 1.5], rel=1e-15)
