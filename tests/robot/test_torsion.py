"""How far joints twist, against a root finder, differences and limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from metro.robot.torsion import Torsion, passed, spring, spring_slope

STIFFNESS = np.array([1.8e6, 2.1e6, 1.3e6, 3.1e5, 3.9e5, 2.3e5])
torques = st.floats(-3e3, 3e3)
stiffnesses = st.floats(1e4, 1e7)
shares = st.floats(1e-12, 1e3)  # of the cubic part at the linear torsion


@given(torques, stiffnesses, shares)
@settings(max_examples=200, deadline=None)
def test_the_torsion_balances_the_torque(torque, k, share):
    far = abs(torque) / k
    cubic = share * k / max(far, 1e-9) ** 2
    root = brentq(lambda x: k * x + cubic * x**3 - torque, -far - 1e-12, far + 1e-12, xtol=1e-18, rtol=1e-14)
    assert spring(np.float64(torque), np.float64(1 / k), np.float64(cubic)) == pytest.approx(root, rel=1e-9)


@given(torques, stiffnesses, st.floats(0.0, 10.0))
@settings(max_examples=100, deadline=None)
def test_the_slope_is_the_derivative_by_the_compliance(torque, k, share):
    c, cubic = 1 / k, share * k**3 / max(abs(torque), 1.0) ** 2
    step = 1e-5 * c
    torque, cubic = np.float64(torque), np.float64(cubic)
    difference = (spring(torque, c + step, cubic) - spring(torque, c - step, cubic)) / (2 * step)
    found = spring_slope(torque, spring(torque, c, cubic), c, cubic)
    assert found == pytest.approx(difference, rel=1e-5, abs=1e-6)


def test_without_hardening_it_is_a_linear_spring_even_of_no_or_negative_compliance():
    torque = np.array([-200.0, 0.0, 350.0])
    for compliance in (0.0, 3e-6, -1e-7):
        np.testing.assert_array_equal(spring(torque, compliance, np.float64(0.0)), torque * compliance)
    assert spring(np.float64(100.0), -1e-7, np.float64(1e12)) == pytest.approx(-1e-5)
    assert spring_slope(np.float64(100.0), np.float64(0.0), 0.0, np.float64(1e12)) == 100.0


def test_weak_hardening_leaves_no_rounding_and_strong_leaves_the_cube_root():
    c, torque = 1e-6, np.float64(500.0)
    assert spring(torque, c, np.float64(1e-3)) == pytest.approx(c * 500.0, rel=1e-14)
    assert spring(torque, c, np.float64(1e24)) == pytest.approx((500.0 / 1e24) ** (1 / 3), rel=1e-3)


def test_a_gap_is_passed_by_half_to_the_side_of_the_torque_whatever_its_size():
    torque = np.array([[40.0, -8.0], [400.0, -80.0], [-400.0, 0.0]])
    found = passed(torque, np.array([2e-4, 6e-4]), np.zeros(2))
    np.testing.assert_allclose(found, [[1e-4, -3e-4], [1e-4, -3e-4], [-1e-4, 0.0]], rtol=0.02)
    assert (passed(np.zeros((3, 2)), np.array([2e-4, 6e-4]), np.zeros(2)) == 0).all()
    assert (passed(torque, np.zeros(2), np.zeros(2)) == 0).all()


def test_a_gap_is_passed_where_the_torque_overcomes_the_drag_and_hardly_where_it_does_not():
    torque = np.array([[3.0], [20.0], [120.0], [-120.0]])
    share = passed(torque, np.array([2.0]), np.array([20.0]))[:, 0]
    assert share[0] < 0.2
    assert 0.5 < share[1] < 0.9
    np.testing.assert_allclose(share[2:], [1.0, -1.0], rtol=1e-3)
    twist = Torsion().with_joint(0, gap=2.0, drag=20.0).in_cut(torque, np.zeros(1))
    np.testing.assert_allclose(twist.angle[:, 0], share)


def test_gap_and_factor_act_in_the_cut_alone_and_hardening_in_both():
    torque = np.tile([300.0, -200.0, 150.0, -60.0, 50.0, 40.0], (4, 1))
    odd = Torsion().with_joint(1, gap=1e-4).with_joint(1, factor=0.5).with_joint(4, cubic=5e11)
    rest = odd.at_rest(torque, 1 / STIFFNESS).angle
    cut = odd.in_cut(torque, 1 / STIFFNESS).angle
    linear = torque / STIFFNESS
    np.testing.assert_allclose(np.delete(rest, 4, axis=1), np.delete(linear, 4, axis=1))
    assert (rest[:, 4] < 0.99 * linear[:, 4]).all()
    np.testing.assert_allclose(cut[:, 4], rest[:, 4])
    np.testing.assert_allclose(cut[:, 1], 2 * linear[:, 1] - 0.5e-4)
    np.testing.assert_allclose(STIFFNESS[4] * rest[:, 4] + 5e11 * rest[:, 4] ** 3, torque[:, 4])


def test_what_is_told_twice_of_a_joint_adds_up():
    twice = Torsion().with_joint(2, gap=1e-4, factor=0.8).with_joint(2, gap=2e-4, factor=0.5)
    assert twice.with_joint(1, gap=1e-4, drag=5.0).drag[1] == 5.0
    assert twice.gap[2] == pytest.approx(3e-4)
    assert twice.factor[2] == pytest.approx(0.4)
    assert twice.gap[:2] == (0.0, 0.0)
    assert not any(twice.cubic)


def test_what_stays_straight_is_a_spring_in_series_with_the_one_that_hardens():
    """Both carry the whole torque: 30 % of the compliance as it is, the rest by the root finder."""
    torque, c, cubic = np.linspace(-900.0, 900.0, 7)[:, None], 1e-6, 4e14
    hard = Torsion().with_joint(0, cubic=cubic)
    found = hard.at_rest(torque, np.array([c]), np.array([0.3])).angle[:, 0]
    alone = [
        brentq(lambda x, t=t: x / (0.7 * c) + cubic * x**3 - t, -1e-2, 1e-2, xtol=1e-18) for t in torque[:, 0]
    ]
    np.testing.assert_allclose(found, 0.3 * c * torque[:, 0] + alone, rtol=1e-9, atol=1e-15)
    assert abs(found[-1]) > 1.2 * abs(hard.at_rest(torque, np.array([c])).angle[-1, 0])


def test_the_slopes_of_springs_in_series_are_their_derivatives():
    torque, c, s = np.array([[-700.0, 30.0], [200.0, 900.0]]), np.array([1e-6, 3e-6]), np.array([0.2, 0.4])
    hard = Torsion((), (), (4e14, 1e13), (0.8,))

    def angle(c, s):
        return hard.in_cut(torque, c, s).angle

    found = hard.in_cut(torque, c, s)
    by_c = (angle(c * 1.0001, s) - angle(c * 0.9999, s)) / (2e-4 * c)
    by_s = (angle(c, s + 1e-5) - angle(c, s - 1e-5)) / 2e-5
    np.testing.assert_allclose(found.by_compliance * [1.0, 1.0], by_c, rtol=1e-5)
    np.testing.assert_allclose(found.by_straight, by_s, rtol=1e-5)
