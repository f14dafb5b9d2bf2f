"""What a normal matrix determines, and a descent from a start that no share of a Gauss–Newton step leaves."""

import numpy as np
import pytest
import strd

from metro.loop.fitting.system import condition, inverse


def columns_apart(share):
    """Return two columns of length one that differ by a share of a third one, square to them."""
    basis = np.linalg.qr(np.random.default_rng(3).normal(size=(30, 2)))[0]
    return np.column_stack([basis[:, 0], basis[:, 0] + share * basis[:, 1]])


def test_columns_of_a_condition_of_two_hundred_thousand_are_told_apart():
    share = 1e-5  # normal matrix [[1, 1], [1, 1 + share²]]: its inverse by hand
    normal = columns_apart(share).T @ columns_apart(share)
    assert condition(normal) == pytest.approx(2 / share, rel=1e-5)
    assert np.diag(inverse(normal)) == pytest.approx([1 / share**2 + 1, 1 / share**2], rel=1e-5)


def test_columns_that_differ_by_less_than_a_normal_matrix_holds_are_not():
    normal = columns_apart(1e-7).T @ columns_apart(1e-7)
    assert condition(normal) == np.inf
    assert np.isinf(np.diag(inverse(normal))).all()


def test_a_start_that_no_share_of_a_step_leaves_is_left_by_a_damped_one():
    x = np.linspace(70.0, 760.0, 14)
    truth, far = np.array([240.0, 5.5e-4]), np.array([500.0, 1e-4])  # as Misra1a of NIST, without its noise

    def grown(b):
        return b[0] * (1.0 - np.exp(-b[1] * x))

    y = grown(truth) + 0.1 * np.cos(x)
    problem = strd.Problem("grown", y, grown, (far, truth), truth, np.ones(2), 1.0)
    one, other = (strd.reached(problem, start) for start in problem.starts)
    assert one.usable
    assert other.usable
    assert one.digits == pytest.approx(other.digits, rel=1e-6)
