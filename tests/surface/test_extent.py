"""Extents of a cloud: rectangles whose sides are known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from metro.surface.extent import face_sides, misfit

RNG = np.random.default_rng(0)


def face(width, height, count=4000):
    corners = np.array([[0, 0, 0], [width, 0, 0], [0, height, 0], [width, height, 0]], float)
    return np.vstack([corners, RNG.uniform(0, [width, height, 0.05], (count, 3))])


@pytest.mark.parametrize("sides", [(100.0, 60.0), (60.0, 60.0), (300.0, 20.0)])
@pytest.mark.parametrize("seed", range(4))
def test_sides_do_not_depend_on_how_a_scan_is_turned(sides, seed):
    rotation = Rotation.random(random_state=seed)
    points = rotation.apply(face(*sides)) + np.array([1e4, -2e3, 5e3])
    np.testing.assert_allclose(face_sides(points, placed=False), sides, rtol=2e-3)


def test_sides_of_a_placed_cloud_are_those_along_x_and_y():
    np.testing.assert_allclose(face_sides(face(60.0, 100.0), placed=True), [60.0, 100.0])


def test_points_far_from_all_others_are_no_part_of_the_extents():
    points = np.vstack([face(100.0, 60.0), RNG.uniform(-1e4, 1e4, (20, 3))])
    np.testing.assert_allclose(face_sides(points, placed=False), [100.0, 60.0], rtol=2e-3)


def test_points_on_a_line_have_no_sides():
    with pytest.raises(ValueError, match="line"):
        face_sides(np.outer(np.arange(50.0), [1.0, 2.0, 3.0]), placed=False)


@pytest.mark.parametrize(
    ("found", "unit"),
    [
        ([100.0, 60.0], None),
        ([90.0, 66.0], None),
        ([0.1, 0.06], "metres"),
        ([3.94, 2.36], "inches"),
        ([10.0, 6.0], "centimetres"),
        ([1e5, 6e4], "micrometres"),
        ([100.0, 30.0], ""),
        ([250.0, 150.0], ""),
    ],
)
def test_a_size_that_does_not_fit_is_told_by_its_unit(found, unit):
    due = np.array([100.0, 60.0])
    assert misfit(np.array(found), due / 1.25, due * 1.25) == unit
