"""Friction above its Coulomb level where a joint creeps, along paths."""

import numpy as np
import pytest

from metro.robot.stribeck import stribeck
from metro.units import MRAD


def paths(above, creep, *, level=0.9, viscous=6.0, noise=0.0, slowest=0.5):
    """Friction at 24 speeds both ways, by the curve's formula; where a joint turns, it is not all there."""
    speed = np.geomspace(slowest, 40.0, 12) * MRAD
    rate, state = np.concatenate([speed, -speed]), np.repeat([1.0, -1.0], 12)
    state[[0, 12]] *= 0.4
    friction = level * state * (1.0 + above * np.exp(-((rate / creep) ** 2))) + viscous * rate
    return rate, state, friction + noise * np.random.default_rng(3).normal(size=24)


@pytest.mark.parametrize(("above", "creep_mrad_s"), [(0.15, 3.0), (0.4, 8.0), (0.6, 2.0)])
def test_a_curve_is_found_from_its_friction(above, creep_mrad_s):
    found = stribeck(*paths(above, creep_mrad_s * MRAD, noise=0.005), 0.005)
    speeds = np.array([0.0, 1.0, 3.0, 10.0, 30.0]) * MRAD
    true = 1.0 + above * np.exp(-((speeds / (creep_mrad_s * MRAD)) ** 2))
    np.testing.assert_allclose(found.at(speeds), true, atol=0.05)


def test_friction_that_only_grows_with_speed_has_no_peak():
    np.testing.assert_allclose(stribeck(*paths(0.0, 1.0), 0.005).at(np.array([0.0, 0.01])), 1.0, atol=0.01)


def test_speeds_that_were_never_seen_are_not_given_more_than_joints_have():
    """Above the creep speed all curves are alike: then at rest it is what is usual, or nothing."""
    seen = paths(0.3, 1.0 * MRAD, slowest=8.0, noise=0.01)
    assert 1.0 <= stribeck(*seen, 0.01).at(np.zeros(1))[0] < 2.0
