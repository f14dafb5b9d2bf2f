"""Friction above its Coulomb level where a joint creeps, from means over speeds."""

import numpy as np
import pytest

from metro.robot.stribeck import Stribeck, stribeck
from metro.units import MRAD


def means(above, creep, *, coulomb=60.0, viscous=400.0, noise=0.0, slowest=0.5):
    """What resists at 24 speeds both ways, by the curve's formula."""
    speed = np.geomspace(slowest, 40.0, 12) * MRAD
    rate = np.concatenate([speed, -speed])
    size = coulomb * (1.0 + above * np.exp(-((speed / creep) ** 2))) + viscous * speed
    scatter = noise * np.random.default_rng(3).normal(size=24)
    return rate, np.concatenate([size, -size]) + scatter


@pytest.mark.parametrize(("above", "creep_mrad_s"), [(0.15, 3.0), (0.4, 8.0), (0.6, 2.0)])
def test_a_curve_is_found_from_its_means(above, creep_mrad_s):
    found = stribeck(*means(above, creep_mrad_s * MRAD, noise=0.3), 0.3)
    speeds = np.array([0.0, 1.0, 3.0, 10.0, 30.0]) * MRAD
    true = 1.0 + above * np.exp(-((speeds / (creep_mrad_s * MRAD)) ** 2))
    np.testing.assert_allclose(found.at(speeds), true, atol=0.05)


def test_friction_that_only_grows_with_speed_has_no_peak():
    np.testing.assert_allclose(stribeck(*means(0.0, 1.0), 0.3).at(np.array([0.0, 0.01])), 1.0, atol=0.01)


def test_speeds_that_were_never_seen_are_not_given_more_than_joints_have():
    """Above the creep speed all curves are alike: then at rest it is what is usual, or nothing."""
    rate, torque = means(0.3, 1.0 * MRAD, slowest=8.0, noise=0.5)
    assert 1.0 <= stribeck(rate, torque, 0.5).at(np.zeros(1))[0] < 2.0


def test_without_means_there_is_no_peak():
    assert stribeck(np.zeros(0), np.zeros(0), 1.0) == Stribeck()
