"""Seconds for a diagram of 201 speeds: the one-mode benchmark of the literature, and eight modes in two
directions.

Peer: the first-order semi-discretisation of this package at one speed and depth (a diagram needs 201 × 101 of
these). Floor: an eigenvalue problem of the size of the arc per speed. Run: ``pytest
benchmarks/bench_lobes.py``.
"""

import numpy as np
import pytest

from metro.dynamics import semidiscretisation
from metro.dynamics.lobes import stability_boundary
from metro.dynamics.system import Cut, Structure, immersion

OMEGA = 2 * np.pi * 922.0
ONE = Structure(np.array([0]), np.array([OMEGA]), np.array([0.011]), np.array([0.03993 * OMEGA**2]))
EIGHT = Structure(
    np.repeat([0, 1], 4),
    2 * np.pi * np.array([21.3, 34.7, 56.6, 65.5, 31.4, 35.1, 54.7, 67.3]),
    np.array([0.061, 0.071, 0.036, 0.063, 0.067, 0.048, 0.050, 0.038]),
    np.array([7.3e6, 4.1e6, 4.2e6, 2.2e6, 3.2e8, 7.1e7, 4.7e7, 1.5e7]),
)


@pytest.mark.parametrize("share", [1.0, 0.5, 0.05])
def test_one_mode(benchmark, share):
    cut = Cut(2, *immersion("down", share, 1.0), 6e8, 2e8)
    boundary = benchmark(stability_boundary, ONE, cut, np.linspace(5000, 10000, 201))
    assert np.all(np.isfinite(boundary.depth))


def test_eight_modes_of_two_directions(benchmark):
    cut = Cut(4, 0.0, np.pi, 10145e6, 11036.5e6)
    boundary = benchmark(stability_boundary, EIGHT, cut, np.linspace(500, 2500, 201))
    assert np.all(np.isfinite(boundary.depth))


def test_peer_one_point_by_semidiscretisation(benchmark):
    cut = Cut(2, *immersion("down", 1.0, 1.0), 6e8, 2e8)
    assert benchmark(semidiscretisation.spectral_radius, ONE, cut, 5000.0, 5e-4, 200) > 1
