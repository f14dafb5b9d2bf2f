"""Exact integrals along the edge against a brute-force slice integration written here, and against slices."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement, engagement
from metro.cutting.force import ANGLES, _assembled, force_basis
from metro.cutting.law import EdgeLaw
from metro.cutting.slices import sliced

SLOT = Engagement(0.0, math.pi)
ANGLE = 2 * math.pi * np.arange(ANGLES) / ANGLES
# [T] table 4, N/m² and N/m
TITANIUM = np.array([10145e6, 11036.5e6, 5000e6, 591.92e3, 100.03e3, 214.32e3])


def cutter(teeth=4, helix=40.0, radius=6e-3, **runout):
    return Cutter(radius, math.radians(helix), evenly_pitched(teeth), **runout)


def brute_force(tool, cut, coefficients, angle, slices=400):
    """Slice the edge and step through the teeth one by one, with the chip thickness written out."""
    force = np.zeros(3)
    dz = cut.axial_depth / slices
    n = tool.teeth
    for i in range(slices):
        lag = (i + 0.5) * dz * math.tan(tool.helix) / tool.radius
        offset = [tool.runout_radius * math.cos(tool.runout_angle - a + lag) for a in tool.tooth_angles]
        for j, tooth in enumerate(tool.tooth_angles):
            phi = (angle + tooth - lag) % (2 * math.pi)
            if not cut.engagement.entry < phi < cut.engagement.exit:
                continue
            h = math.inf
            for m in range(1, n + 1):
                earlier = (j + m) % n
                pitch = (tool.tooth_angles[earlier] - tooth) % (2 * math.pi) or 2 * math.pi
                feed = cut.feed_per_tooth * n * pitch / (2 * math.pi)
                h = min(h, feed * math.sin(phi) + offset[j] - offset[earlier])
            if h <= 0:
                continue
            ft, fr, fa = (coefficients[k] * h + coefficients[k + 3] for k in range(3))
            force += dz * np.array(
                [-ft * math.cos(phi) - fr * math.sin(phi), ft * math.sin(phi) - fr * math.cos(phi), fa]
            )
    return force


@settings(max_examples=15, deadline=None)
@given(
    st.integers(1, 5),
    st.floats(2.0, 50.0),
    st.floats(0.0, 30e-6),
    st.tuples(st.floats(0.0, 6.28), st.floats(0.0, 0.3), st.sampled_from([3e-3, 40e-3])),
)
def test_force_is_that_of_a_brute_force_slice_integration(teeth, helix, runout, other):
    direction, shift, depth = other
    angles = [a + shift * math.sin(3 * i) for i, a in enumerate(evenly_pitched(teeth))]
    tool = Cutter(6e-3, math.radians(helix), tuple(angles), runout, direction)
    cut = Cut(0.03e-3, depth, engagement("side", "up", 5e-3, 6e-3))
    table = force_basis(tool, EdgeLaw(), cut) @ TITANIUM
    steps = (0, 170, 500)
    expected = np.array([brute_force(tool, cut, TITANIUM, 2 * math.pi * step / ANGLES) for step in steps])
    # What the brute force does not resolve: each tooth enters, leaves and bounds the chip within a slice.
    tooth = np.abs(TITANIUM[:3]).max() * 0.03e-3 + np.abs(TITANIUM[3:]).max()
    assert table[list(steps)] == pytest.approx(expected, abs=3 * teeth * tooth * depth / 400)


@pytest.mark.parametrize("runout", [0.0, 8e-6])
def test_slices_tend_to_the_exact_integral_as_they_get_thinner(runout):
    tool = cutter(runout_radius=runout, runout_angle=0.4)
    cut = Cut(0.05e-3, 20e-3, engagement("side", "down", 4e-3, 6e-3))
    exact = force_basis(tool, EdgeLaw(), cut)
    scale = np.abs(exact).max(axis=(0, 1))

    def error(per_radian):
        basis = _assembled(sliced(tool, EdgeLaw(), cut, true_path=False, angle=ANGLE, per_radian=per_radian))
        return math.sqrt(np.mean(((basis - exact) / scale) ** 2))

    assert error(12) < 0.01
    assert error(48) < error(12) / 4
    assert error(96) < error(48) / 2


@pytest.mark.parametrize("law", [EdgeLaw(), EdgeLaw(size_exponent=0.25)], ids=["linear", "power"])
def test_the_spline_of_true_paths_and_power_laws_is_the_sum_of_thin_slices(law):
    tool, step = cutter(), 2 * math.pi / ANGLES
    cut = Cut(0.1e-3, 30 * step / tool.lag_per_depth, SLOT)  # slices that span a step of the table each
    table = force_basis(tool, law, cut, True)
    thin = _assembled(sliced(tool, law, cut, true_path=True, angle=ANGLE, per_radian=1 / step))
    scale = np.abs(thin).max(axis=(0, 1))
    assert table / scale == pytest.approx(thin / scale, abs=2e-4)
