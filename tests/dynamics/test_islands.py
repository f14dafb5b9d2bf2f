"""All crossings against the count of multipliers outside the unit circle."""

import numpy as np
import pytest
from machines import BENCH, TWO

from metro.dynamics import collocation
from metro.dynamics.islands import all_crossings
from metro.dynamics.lobes import discretised, stability_boundary
from metro.dynamics.system import Cut, immersion

HALF, LITTLE = (Cut(2, *immersion("down", share, 1.0), 6e8, 2e8) for share in (0.5, 0.05))
CASES = {
    "low immersion": (BENCH, LITTLE, np.linspace(5000, 10000, 17), 8e-3),
    "half immersion": (BENCH, HALF, np.linspace(5000, 10000, 17), 4e-3),
    "two directions": (TWO, Cut(4, 0.0, np.pi, 1e9, 4e8), np.linspace(500, 2500, 17), 2e-3),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_crossings_account_for_every_multiplier_outside_the_unit_circle(name):
    structure, cut, rpm, deepest = CASES[name]
    found = all_crossings(structure, cut, rpm, deepest)
    assert found.complete.all()
    equation = discretised(structure, cut, rpm, 1.5, 10)[1]
    for depth in np.linspace(0.04, 0.98, 17) * deepest:
        outside = np.abs(collocation.multipliers(equation, np.full(len(rpm), depth))) > 1
        told = [found.unstable(i, depth) for i in range(len(rpm))]
        np.testing.assert_array_equal(outside.sum(axis=1), told)


def test_multipliers_come_back_where_a_lobe_ends():
    structure, cut, _, deepest = CASES["half immersion"]
    found = all_crossings(structure, cut, np.linspace(5000, 10000, 41), deepest)
    assert np.any(found.multipliers < 0)
    assert set(np.abs(found.multipliers[found.kind == "flip"])) == {1}
    assert set(np.abs(found.multipliers[found.kind == "hopf"])) == {2}


@pytest.mark.parametrize("name", CASES)
def test_the_least_crossing_is_the_boundary(name):
    structure, cut, rpm, deepest = CASES[name]
    found = all_crossings(structure, cut, rpm, deepest)
    boundary = stability_boundary(structure, cut, rpm)
    for i in np.flatnonzero(boundary.depth < deepest):
        first = np.flatnonzero(found.speed == i)[0]
        assert found.depth[first] == pytest.approx(boundary.depth[i], rel=1e-6)
        assert found.chatter_hz[first] == pytest.approx(boundary.chatter_hz[i], rel=1e-6)
        assert found.kind[first] == boundary.kind[i]
        assert found.multipliers[first] > 0
