"""Arcs of engagement: what is left of a side cut whose wall stands proud."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from metro.cutting.engagement import engagement, with_wall_proud

RADIUS = 8e-3
SIDES = st.sampled_from(["up", "down"])


@given(SIDES, st.floats(0.2e-3, 15e-3), st.floats(-0.9, 0.85))
def test_a_proud_wall_is_a_smaller_radial_depth(direction, radial, share):
    proud = share * radial
    expected = engagement("side", direction, min(radial - proud, 2 * RADIUS), RADIUS)
    found = with_wall_proud(engagement("side", direction, radial, RADIUS), RADIUS, proud)
    assert found.entry == pytest.approx(expected.entry, abs=1e-6)
    assert found.exit == pytest.approx(expected.exit, abs=1e-6)


@given(SIDES)
def test_a_tenth_of_the_depth_stays_and_the_diameter_is_the_most(direction):
    arc = engagement("side", direction, 3e-3, RADIUS)
    least, most = (with_wall_proud(arc, RADIUS, proud) for proud in (5e-3, -20e-3))
    assert least.exit - least.entry == pytest.approx(math.acos(1 - 0.3e-3 / RADIUS))
    assert most.exit - most.entry == pytest.approx(math.pi)
