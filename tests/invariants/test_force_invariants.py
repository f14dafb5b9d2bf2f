"""The force of a cut does not depend on the unit of length, on which tooth is the first, or on slicing."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter
from metro.cutting.engagement import Engagement
from metro.cutting.force import ANGLES, force_basis, mean_basis
from metro.cutting.law import EdgeLaw

STEP = 2.0 * math.pi / ANGLES
FEW = settings(max_examples=15, deadline=None, derandomize=True, database=None)
LAW = EdgeLaw()


def within(low, high):
    return st.floats(low, high, allow_nan=False)


def alike(found, expected):
    """Compare two tables, each coefficient's to what the edge's quadrature is good for."""
    most = np.abs(expected).max(axis=(0, 1))
    return bool((np.abs(found - expected) <= 1e-8 * most).all())


@st.composite
def cutters(draw):
    """A cutter whose teeth stand at whole angular steps, none nearer to another than 30 degrees."""
    teeth = draw(st.integers(1, 4))
    pitches = draw(st.lists(st.integers(60, 200), min_size=teeth, max_size=teeth))
    places = np.cumsum([0, *pitches])[:-1] * (ANGLES / sum(pitches))
    angles = tuple((STEP * np.round(places)).tolist())
    return Cutter(
        draw(within(2e-3, 2e-2)), math.radians(draw(within(5.0, 45.0))), angles,
        draw(st.sampled_from([0.0, 5e-6])), draw(within(0.0, 6.0)),
    )  # fmt: skip


@st.composite
def cuts(draw):
    entry = draw(within(0.0, 2.0))
    arc = Engagement(entry, draw(within(entry + 0.3, math.pi)))
    return Cut(draw(within(2e-5, 2e-4)), draw(within(5e-4, 5e-3)), arc)


@FEW
@given(cutters(), cuts(), within(0.2, 1000.0))
def test_in_another_unit_of_length_shear_goes_by_area_and_edge_by_length(cutter, cut, unit):
    other = Cutter(
        cutter.radius * unit, cutter.helix, cutter.tooth_angles, cutter.runout_radius * unit,
        cutter.runout_angle,
    )  # fmt: skip
    same = Cut(cut.feed_per_tooth * unit, cut.axial_depth * unit, cut.engagement)
    here, there = force_basis(cutter, LAW, cut), force_basis(other, LAW, same)
    size = np.repeat([unit**2, unit], 3)
    assert alike(there / size, here)


@FEW
@given(cutters(), cuts(), st.integers(0, 3))
def test_whichever_tooth_is_called_the_first_the_force_is_the_same(cutter, cut, first):
    first %= cutter.teeth
    turn = cutter.tooth_angles[first]
    angles = [(angle - turn) % (2.0 * math.pi) for angle in np.roll(cutter.tooth_angles, -first)]
    other = Cutter(
        cutter.radius, cutter.helix, tuple(angles), cutter.runout_radius, cutter.runout_angle - turn
    )
    here, there = force_basis(cutter, LAW, cut), force_basis(other, LAW, cut)
    assert alike(np.roll(there, -round(turn / STEP), axis=0), here)


@FEW
@given(cutters(), cuts(), st.integers(2, 60), within(2.0, 60.0))
def test_a_cut_is_the_sum_of_its_slices_the_upper_one_later(cutter, cut, lag, rest):
    # in angular steps: an edge that lags by less than one is averaged over it
    lower, height = (steps * STEP / cutter.lag_per_depth for steps in (lag, rest))
    upper = Cut(cut.feed_per_tooth, height, cut.engagement)
    whole = Cut(cut.feed_per_tooth, lower + height, cut.engagement)
    raised = Cutter(
        cutter.radius, cutter.helix, cutter.tooth_angles, cutter.runout_radius,
        cutter.runout_angle + cutter.lag_per_depth * lower,
    )  # fmt: skip
    below = force_basis(cutter, LAW, Cut(cut.feed_per_tooth, lower, cut.engagement))
    parts = below + np.roll(force_basis(raised, LAW, upper), lag, axis=0)
    expected = force_basis(cutter, LAW, whole)
    assert alike(parts, expected)


@FEW
@given(cutters(), cuts())
def test_in_a_mirror_up_milling_is_down_milling(cutter, cut):
    arc = Engagement(math.pi - cut.engagement.exit, math.pi - cut.engagement.entry)
    straight = Cutter(cutter.radius, cutter.helix, cutter.tooth_angles)
    here = mean_basis(straight, LAW, cut)
    there = mean_basis(straight, LAW, Cut(cut.feed_per_tooth, cut.axial_depth, arc))
    mirror = np.array([[-1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, 1.0]])
    np.testing.assert_allclose(there * np.tile(mirror, 2), here, rtol=1e-9, atol=1e-9 * np.abs(here).max())
