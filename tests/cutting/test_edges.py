"""Integrals along the edge against brute-force slice integrations written here."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.cutting.chip import Cut, chip_thickness
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement, engagement
from metro.cutting.force import ANGLES, force_basis
from metro.cutting.law import EdgeLaw
from metro.cutting.quadrature import rule

SLOT = Engagement(0.0, math.pi)
# [T] table 4, N/m² and N/m
TITANIUM = np.array([10145e6, 11036.5e6, 5000e6, 591.92e3, 100.03e3, 214.32e3])


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


def within_work(h, tip, phi, engaged, radius):
    """Chip on the rays at φ, between ``tip`` less ``h`` and ``tip`` from the axis, within the work."""
    first, last = tip - h, tip
    for edge, side in ((engaged.entry, 1.0), (engaged.exit, -1.0)):
        if 0.0 < edge < math.pi:  # the work is where side × (distance × cos φ − y of the edge) < 0
            crossing = radius * math.cos(edge) / np.cos(phi)
            leaves = side * np.cos(phi) > 0.0
            last = np.where(leaves, np.minimum(last, crossing), last)
            first = np.where(leaves, first, np.maximum(first, crossing))
    return np.maximum(last - first, -1e-4)  # none is none, however far from the work


def thin_slices(tool, law, cut, angle, *, true_path, slices=40_000):
    """Thin slices of every stretch of edge in the arc: thrust per unit of K_tc, K_rc, K_ac, K_te, K_re, K_ae.

    Where the chip begins or ends along the feed, the chip decides, and in part of a slice; on true paths at
    the raw edges as well.
    """
    basis, helix = np.zeros((3, 6)), tool.lag_per_depth
    beyond = 0.2 if true_path else 0.0
    entry, leaving = cut.engagement.entry, cut.engagement.exit
    entry, leaving = (-beyond, math.pi + beyond) if true_path else (entry, leaving)
    for j, tooth in enumerate(tool.tooth_angles):
        for turn in (-2, -1, 0, 1, 2):
            leading = angle + tooth + 2 * math.pi * turn
            ends = np.clip([(leading - leaving) / helix, (leading - entry) / helix], 0.0, cut.axial_depth)
            dz = (ends[1] - ends[0]) / slices
            if dz <= 0.0:
                continue
            z = ends[0] + (np.arange(slices) + 0.5) * dz
            phi = leading - helix * z
            immersion = np.repeat(phi[None, :, None], tool.teeth, axis=2)
            h = chip_thickness(tool, cut, immersion, z, true_path)[0, :, j]
            if true_path:
                h = within_work(
                    h, tool.radius + tool.radius_deviation(z)[j], phi, cut.engagement, tool.radius
                )
            change = np.abs(np.gradient(h))
            share = np.clip(h / np.maximum(change, 1e-30) + 0.5, 0.0, 1.0)
            shear = law.shear(np.where(share < 1.0, 0.5 * share**2 * change, h))
            tangential = np.stack([-np.cos(phi), np.sin(phi)])
            radial = np.stack([-np.sin(phi), -np.cos(phi)])
            for column, weight in ((0, shear), (3, share)):
                basis[:2, column] += tangential @ weight * dz
                basis[:2, column + 1] += radial @ weight * dz
                basis[2, column + 2] += weight.sum() * dz
    return basis


EVEN, UNEVEN = evenly_pitched(4), (0.0, 1.4, 3.3, 4.9)
UP, DOWN = engagement("side", "up", 2e-3, 6e-3), engagement("side", "down", 9e-3, 6e-3)


@pytest.mark.parametrize("exponent", [0.0, 0.25], ids=["linear", "power"])
@pytest.mark.parametrize("true_path", [False, True], ids=["circular", "true"])
@pytest.mark.parametrize(
    ("angles", "runout", "cut"),
    [
        (EVEN, 8e-6, Cut(0.05e-3, 3e-3, SLOT)),
        (EVEN, 8e-6, Cut(0.02e-3, 30e-3, UP)),
        (EVEN, 20e-6, Cut(0.02e-3, 2e-3, DOWN)),
        (UNEVEN, 8e-6, Cut(0.1e-3, 3e-3, SLOT)),
        (UNEVEN, 0.0, Cut(0.05e-3, 20e-3, DOWN)),
        ((0.0, math.pi), 5e-6, Cut(0.1e-3, 5e-3, Engagement(0.5, 2.4))),
        ((0.0,), 5e-6, Cut(0.1e-3, 5e-3, SLOT)),
    ],
)
def test_force_is_that_of_very_thin_slices(angles, runout, cut, true_path, exponent):
    tool = Cutter(6e-3, math.radians(35), angles, runout, 0.7)
    law = EdgeLaw(size_exponent=exponent, reference_thickness=cut.feed_per_tooth)
    table = force_basis(tool, law, cut, true_path)
    scale = np.abs(table).max(axis=(0, 1))
    seen = tool.about_axis(0.5 * cut.axial_depth) if true_path else tool
    for step in (3, 150, 362, 555):
        thin = thin_slices(seen, law, cut, 2 * math.pi * step / ANGLES, true_path=true_path)
        assert table[step] / scale == pytest.approx(thin / scale, abs=1e-6)


def test_a_helix_the_other_way_is_a_tool_turned_by_the_lag():
    # Seen from its other end, an edge that lags is one that leads; the runout turns with it.
    cut, step = Cut(0.05e-3, 3e-3, UP), 2 * math.pi / ANGLES
    helix = math.atan(50 * step / 3e-3 * 6e-3)
    right = Cutter(6e-3, helix, EVEN, 8e-6, 0.4)
    left = Cutter(6e-3, -helix, EVEN, 8e-6, 0.4 + 50 * step)
    expected = np.roll(force_basis(right, EdgeLaw(), cut, True), -50, axis=0)
    found = force_basis(left, EdgeLaw(), cut, True)
    assert found == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("power", [0, 1, 4, 0.6, 0.85, 1.6])
def test_the_rule_of_roots_integrates_powers_of_the_distance_from_both_ends(power):
    points, weights = rule(4, False)
    exact = 1 / (power + 1)
    assert weights @ points**power == pytest.approx(exact, rel=2e-6)
    assert weights @ (1 - points) ** power == pytest.approx(exact, rel=2e-6)


@settings(max_examples=60, deadline=None)
@given(st.floats(0.01, 1.5))
def test_an_arc_as_short_as_any_is_integrated_to_a_billionth_of_itself(length):
    # An arc that begins where the chip does is the hardest: all that is integrated is small there.
    tool = Cutter(10e-3, math.radians(30.0), (0.0,))
    depth = 1.5 / tool.lag_per_depth
    cut = Cut(0.1e-3, depth, Engagement(0.0, length))
    at = math.ceil(1.5 * ANGLES / (2.0 * math.pi)) - 1
    reached = min(length, at * 2.0 * math.pi / ANGLES)  # the edge is just behind the start of the arc
    shear = 0.1e-3 / tool.lag_per_depth * np.array([
        0.5 * math.sin(reached) ** 2, 0.5 * reached - 0.25 * math.sin(2.0 * reached)
    ])  # fmt: skip
    table = force_basis(tool, EdgeLaw(), cut)[at]
    np.testing.assert_allclose(table[:2, 0], [-shear[0], shear[1]], rtol=1e-9)
