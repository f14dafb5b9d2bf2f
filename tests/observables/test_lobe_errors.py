"""Errors of modes by which a boundary is uncertain: a sensor's mass, the temperature, the true speed."""

import numpy as np
import pytest

from metro.dynamics.lobes import stability_boundary
from metro.dynamics.system import Cut, Structure
from metro.observables.stability.errors import COMMON_SD, OWN_SD, SENSOR, deviations, frequency_sd

OMEGA, STIFFNESS = np.array([1700.0, 2600.0]), np.array([4e6, 6e6])
RPM = np.linspace(2000.0, 6000.0, 23)


def boundary(omega, rpm):
    structure = Structure(np.array([0, 1]), omega, np.array([0.04, 0.03]), STIFFNESS)
    return stability_boundary(structure, Cut(3, 0.0, 1.6, 1e9, 4e8), rpm).depth


def test_a_spindle_that_slips_is_a_machine_whose_frequencies_are_all_higher():
    """What makes the common error: the boundary depends on the speed over the frequencies alone."""
    slip = 0.01
    np.testing.assert_allclose(
        boundary(OMEGA * (1 + slip), RPM), boundary(OMEGA, RPM / (1 + slip)), rtol=1e-6
    )
    assert np.ptp(boundary(OMEGA, RPM / (1 + slip)) / boundary(OMEGA, RPM)) > 0.1


def test_a_sensor_lowers_the_frequency_of_what_it_sticks_to():
    """As a mass added to an oscillator does: f = √(k / (m + δ)) / 2π."""
    mass = np.array([0.2, 1.0, 10.0])
    lowered = 1.0 - np.sqrt(mass / (mass + SENSOR))
    sensor = np.sqrt(frequency_sd(np.zeros(3), mass) ** 2 - OWN_SD**2)
    np.testing.assert_allclose(sensor, lowered, rtol=0.05)


def test_what_was_not_measured_is_known_no_better_than_the_temperature_allows():
    heavy = np.full(2, 1e6)
    np.testing.assert_allclose(
        frequency_sd(np.array([np.nan, 0.004]), heavy), [OWN_SD, np.hypot(0.004, OWN_SD)]
    )


def test_the_frequencies_share_an_error_and_nothing_else_does():
    sd = np.array([0.004, 0.002, 0.05, np.nan, 0.02, 0.03, 0.01, 0.04])
    drawn = deviations(sd, 200_000, 3)
    expected = np.diag(np.nan_to_num(sd) ** 2)
    expected[:2, :2] += COMMON_SD**2
    np.testing.assert_allclose(np.cov(drawn.T), expected, atol=2e-5)
    assert np.cov(drawn[:, 0], drawn[:, 1])[0, 1] == pytest.approx(COMMON_SD**2, rel=0.05)
    np.testing.assert_array_equal(drawn[:, 3], 0.0)
    np.testing.assert_array_equal(deviations(sd, 5, 3), deviations(sd, 5, 3))
