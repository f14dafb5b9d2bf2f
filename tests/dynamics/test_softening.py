"""Stiffness by speed: against the frequencies of a chain of masses whose one spring gives way."""

from dataclasses import replace

import numpy as np
import pytest
from machines import TWO

from metro.dynamics.lobes import stability_boundary
from metro.dynamics.softening import Softening
from metro.dynamics.stability_model import StabilityModel, estimated
from metro.dynamics.system import Cut
from metro.dynamics.zero_order import zero_order_boundary

SIDE, SLOT = Cut(3, 0.0, 0.4 * np.pi, 1e9, 4e8), Cut(4, 0.0, np.pi, 1e9, 4e8)
RPM = np.array([900.0, 1350.0, 1800.0])
SHARES = (0.9, 0.1, 0.0, 0.6)
SQUARE = Softening(-0.3, 1500.0, 2.0, SHARES)


def chain(bearing):
    """Squares of the natural frequencies, and the shares of energy in the first spring, of three masses."""
    mass, springs = np.array([3.0, 1.0, 2.0]), np.array([bearing, 4.0, 7.0])
    stiffness = np.diag(springs + np.append(springs[1:], 0.0))
    stiffness -= np.diag(springs[1:], 1) + np.diag(springs[1:], -1)
    root = 1.0 / np.sqrt(mass)
    squares, vectors = np.linalg.eigh(root[:, None] * stiffness * root)
    shapes = root[:, None] * vectors
    return squares, bearing * shapes[0] ** 2 / np.einsum("im,ij,jm->m", shapes, stiffness, shapes)


@pytest.mark.parametrize("change", [-0.04, 0.04])
def test_a_mode_changes_by_its_share_of_the_energy_in_the_spring_that_does(change):
    at_rest, shares = chain(5.0)
    turning, _ = chain(5.0 * (1.0 + change))
    softening = Softening(change, 3000.0, 2.0, tuple(shares))
    predicted = softening.of_modes(np.array([3000.0]), 3)[0]
    assert shares.sum() == pytest.approx(1.0)  # of one spring, over all modes
    assert np.ptp(shares) > 0.2
    # What is neglected is of second order.
    np.testing.assert_allclose(turning / at_rest - 1.0, predicted, atol=change**2)


def test_no_bearing_is_left_with_less_than_nothing():
    changes = Softening(-2.0, 1000.0, 2.0, SHARES).of_modes(np.array([0.0, 1000.0, 9000.0]), 4)
    assert changes.min() > -1.0
    np.testing.assert_array_equal(changes[0], 0.0)
    np.testing.assert_array_equal(changes[1], changes[2])


def test_a_loss_by_the_square_is_four_times_as_large_at_twice_the_speed():
    slow, fast = SQUARE.of_modes(np.array([500.0, 1000.0]), 5)
    np.testing.assert_allclose(fast, 4.0 * slow)
    assert slow[4] == pytest.approx(-0.3 / 9.0)  # a mode that is added


def test_each_speed_has_modes_softened_each_by_its_own():
    depth, chatter = StabilityModel(TWO, (SIDE, SLOT), 0.006, (SQUARE,)).boundary(RPM)
    for i, rpm in enumerate(RPM):
        left = 1.0 - 0.3 * (rpm / 1500.0) ** 2 * np.array(SHARES)
        own = replace(TWO, omega=np.sqrt(left) * TWO.omega, stiffness=left * TWO.stiffness)
        alone = [stability_boundary(own, cut, np.array([rpm])) for cut in (SIDE, SLOT)]
        lowest = min(alone, key=lambda one: one.depth[0])
        assert depth[i] == pytest.approx(lowest.depth[0], rel=1e-4)
        assert chatter[i] == pytest.approx(lowest.chatter_hz[0], rel=1e-4)


def test_estimates_have_each_speed_softened_by_its_own():
    plain = StabilityModel(TWO, (SIDE,), 0.006)
    depth, hz = estimated([plain, replace(plain, softening=(SQUARE,))], RPM)
    for i, rpm in enumerate(RPM):
        left = 1.0 - 0.3 * (rpm / 1500.0) ** 2 * np.array(SHARES)
        own = replace(TWO, omega=np.sqrt(left) * TWO.omega, stiffness=left * TWO.stiffness)
        for row, structure in enumerate((TWO, own)):
            alone, heard = zero_order_boundary([structure], [SIDE], np.array([[rpm]]))
            assert depth[row, i] == pytest.approx(alone[0, 0], rel=5e-3)
            assert hz[row, i] == pytest.approx(heard[0, 0], rel=5e-3)
