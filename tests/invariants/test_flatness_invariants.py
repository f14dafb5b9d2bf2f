"""A face's indices do not depend on the frame, on the unit, on the order of points, or on how many repeat."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from metro.surface.face import measure_face
from metro.surface.indices import raw_indices
from metro.surface.minimum_zone import minimum_zone
from metro.surface.plane import fit_plane

FEW = settings(max_examples=15, deadline=None, derandomize=True, database=None)
# a turn that leaves the normal's largest component the largest and positive: the sign of deviations stays
TILTS = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-3.0, 3.0))


@st.composite
def faces(draw):
    """Forty touched points of a face of 150 mm by 80 mm that is out of flat by some 0.1 mm."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    x, y = rng.uniform(0.0, 0.15, 40), rng.uniform(0.0, 0.08, 40)
    return np.column_stack([x, y, draw(st.floats(-2.0, 2.0)) * x * y + rng.normal(0.0, 2e-5, 40)])


def told(points):
    """Return what a face says: its raw indices, its minimum zone, and the deviations of its points."""
    deviations = fit_plane(points).deviations(points)
    return [*raw_indices(deviations, 0.0).values(), minimum_zone(points).width], deviations


def same(found, expected):
    np.testing.assert_allclose(found, expected, rtol=1e-6)


@FEW
@given(faces(), TILTS, st.tuples(*[st.floats(-10.0, 10.0)] * 3))
def test_wherever_the_frame_is_the_face_is_the_same(points, tilt, shift):
    moved = Rotation.from_euler("zyx", tilt[::-1]).apply(points) + shift
    (here, deviations), (there, after) = told(points), told(moved)
    same(there, here)
    np.testing.assert_allclose(after, deviations, atol=1e-6 * np.ptp(deviations))
    one, other = (measure_face(each, 1e-6, "declared").indices for each in (points, moved))
    assert set(one) == set(other)
    same([other[name].value for name in one], [one[name].value for name in one])


@FEW
@given(faces(), st.floats(1e-3, 1e3))
def test_in_another_unit_every_length_is_as_many_times_as_large(points, unit):
    (here, deviations), (there, after) = told(points), told(points * unit)
    same(there, np.array(here) * unit)
    np.testing.assert_allclose(after, deviations * unit, atol=1e-6 * unit * np.ptp(deviations))


@FEW
@given(faces(), st.randoms(use_true_random=False))
def test_points_may_come_in_any_order_and_in_pieces(points, draw):
    order = draw.sample(range(len(points)), len(points))
    (here, deviations), (there, after) = told(points), told(points[order])
    same(there, here)
    np.testing.assert_allclose(after, deviations[order], atol=1e-6 * np.ptp(deviations))
    pieces = fit_plane(np.array_split(points[order], 3))
    np.testing.assert_allclose(pieces.normal, fit_plane(points).normal, atol=1e-12)


@FEW
@given(faces(), st.integers(2, 4))
def test_a_face_scanned_several_times_over_is_the_same_face(points, times):
    plane, often = fit_plane(points), fit_plane(np.tile(points, (times, 1)))
    np.testing.assert_allclose(often.normal, plane.normal, atol=1e-12)
    (here, _), (there, _) = told(points), told(np.repeat(points, times, axis=0))
    whole = [0, 1, 2, -1]  # a percentile between points changes with their number
    same(np.array(there)[whole], np.array(here)[whole])


@FEW
@given(faces())
def test_points_between_others_leave_the_minimum_zone_alone(points):
    between = 0.5 * (points[1:] + points[:-1])
    same(minimum_zone(np.vstack([points, between])).width, minimum_zone(points).width)
