"""The proof of stability by powers of the period map, and the boundary that it guards."""

import numpy as np
import pytest
from machines import BENCH, CUTS, TWO

from metro.dynamics import collocation
from metro.dynamics.lobes import discretised, spectral_radius, stability_boundary
from metro.dynamics.system import Cut

SLOT = Cut(2, 0.0, np.pi, 6e8, 2e8)


@pytest.mark.parametrize("name", CUTS)
def test_a_proof_is_given_below_the_boundary_alone(name):
    rpm = np.linspace(600.0, 2400.0, 9)
    equation = discretised(TWO, CUTS[name], rpm, 1.0, 8)[1]
    depth = stability_boundary(TWO, CUTS[name], rpm).depth
    for share in (0.2, 0.7, 0.95, 0.99, 1.01, 1.3):
        proven = collocation.surely_stable(equation, share * depth)
        radius = collocation.spectral_radius(equation, share * depth)
        assert not np.any(proven & (radius >= 1.0))
        assert np.all(proven[radius < 1.0 - 3e-4])


def test_the_period_map_is_that_of_free_flight_without_a_cut():
    equation = discretised(BENCH, SLOT, np.array([5000.0, 7000.0]), 1.0, 8)[1]
    multipliers = collocation.multipliers(equation, np.zeros(2))
    for k in range(2):
        flight = multipliers[k, np.argsort(-np.abs(multipliers[k]))[:2]]
        assert np.sort_complex(flight) == pytest.approx(np.sort_complex(equation.decay[k]), rel=1e-9)


def test_nothing_is_unstable_below_the_boundary_at_the_peaks_of_a_slot():
    rpm = np.concatenate([np.linspace(6650, 6975, 14), np.linspace(8400, 8650, 11), [8925.0, 9275.0]])
    depth = stability_boundary(BENCH, SLOT, rpm).depth
    for share in (0.9985, 0.97, 0.9, 0.7):
        assert np.all(spectral_radius(BENCH, SLOT, rpm, share * depth) < 1.0 + 1e-6)
    assert np.all(spectral_radius(BENCH, SLOT, rpm, 1.0015 * depth) > 1.0)
