"""Interpolated end stiffness: exact where the truth has the method's form, honest where it has not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.robot.stations import (
    MARGIN,
    PLANE,
    SPLINE,
    Stations,
    beyond_hull,
    leave_one_out,
    leave_one_out_interval,
    left_out,
    stiffness_at,
)

# [T] table 5
PLACES = 1e-3 * np.array(
    [[0, 0, 0], [0, 0, -320], [0, 200, -320], [-200, 0, -320], [-400, 0, -320], [-200, 0, 50], [0, 200, 0]]
)
GRADIENT = np.array([[0.4, 0.1, 0.0], [0.0, -0.6, 0.2], [0.5, 0.0, 0.8]])


def exponential(places):
    return 1e6 * np.exp(np.array([0.1, 3.0, 2.0]) + places @ GRADIENT)


def domed(places):
    return np.array([1e6, 3e7, 9e6]) * np.exp(-2.0 * np.sum((places - 0.1) ** 2, axis=-1))[..., None]


def grid(steps):
    axis = np.linspace(-0.2, 0.4, steps)
    return np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)


def test_seven_stations_carry_a_stiffness_that_changes_exponentially_exactly():
    stations = Stations(PLACES, exponential(PLACES))
    place = np.array([-0.1, 0.03, -0.2])
    found = stiffness_at(stations, place)
    assert found.method == PLANE
    np.testing.assert_allclose(found.value, exponential(place), rtol=1e-9)
    np.testing.assert_allclose(leave_one_out(stations), 0.0, atol=1e-9)


def test_a_spline_passes_through_its_stations():
    stations = Stations(grid(3), domed(grid(3)))
    found = stiffness_at(stations, stations.place[5])
    assert found.method == SPLINE
    np.testing.assert_allclose(found.value, stations.stiffness[5], rtol=1e-9)


def test_more_stations_bring_a_spline_nearer_to_a_dome():
    place = np.array([0.13, 0.22, 0.05])
    errors = [
        np.abs(stiffness_at(Stations(grid(n), domed(grid(n))), place).value / domed(place) - 1.0).max()
        for n in (3, 5, 7)
    ]
    assert errors[0] > 2.0 * errors[1] > 4.0 * errors[2]
    assert errors[2] < 1e-3


def test_the_leave_one_out_error_is_that_of_refits_written_out():
    stations = Stations(PLACES, domed(PLACES) * np.linspace(1.0, 1.3, 7)[:, None])
    told = []
    for i in range(7):
        rest = np.arange(7) != i
        design = np.column_stack([np.ones(6), PLACES[rest]])
        told.append(
            np.exp(np.r_[1.0, PLACES[i]] @ np.linalg.lstsq(design, np.log(stations.stiffness[rest]))[0])
        )
    expected = np.sqrt(np.mean((np.array(told) / stations.stiffness - 1.0) ** 2, axis=0))
    np.testing.assert_allclose(leave_one_out(stations), expected, rtol=1e-9)


def test_stations_in_one_plane_say_nothing_across_it():
    flat = grid(4) * (1.0, 1.0, 0.0)
    stations = Stations(flat, exponential(flat))
    below, inside = stiffness_at(stations, np.array([0.1, 0.1, -0.05])), np.array([0.1, 0.1, 0.0])
    assert below.method == PLANE
    assert below.beyond == pytest.approx(0.05, rel=1e-4)
    np.testing.assert_allclose(below.value, exponential(inside), rtol=1e-9)


def test_a_single_station_holds_where_it_stands_and_has_no_leave_one_out_error():
    stations = Stations(PLACES[:1], exponential(PLACES[:1]))
    np.testing.assert_allclose(stiffness_at(stations, PLACES[0]).value, stations.stiffness[0])
    assert np.isnan(leave_one_out(stations)).all()
    with pytest.raises(ValueError, match="beyond"):
        stiffness_at(stations, PLACES[1])


@given(st.lists(st.floats(-1.0, 2.0), min_size=3, max_size=3))
@settings(max_examples=40, deadline=None)
def test_the_distance_from_a_box_is_that_of_its_nearest_corner_edge_or_face(place):
    corners = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1]), axis=-1).reshape(-1, 3).astype(float)
    expected = np.linalg.norm(place - np.clip(place, 0.0, 1.0))
    assert beyond_hull(corners, np.array(place)) == pytest.approx(expected, abs=1e-4)


def test_a_place_far_beyond_the_stations_is_refused():
    stations = Stations(PLACES, exponential(PLACES))
    reach = MARGIN * stations.extent
    near, far = PLACES[4] - (0.95 * reach, 0.0, 0.0), PLACES[4] - (1.05 * reach, 0.0, 0.0)
    assert stiffness_at(stations, near).beyond == pytest.approx(0.95 * reach, rel=1e-3)
    with pytest.raises(ValueError, match="mm beyond the stations, expected at most"):
        stiffness_at(stations, far)


def test_the_interval_of_the_leave_one_out_error_holds_what_other_stations_would_have_told():
    """Stations scatter by 5 % about an exponential: the rms over many tables is within, mostly."""
    rng = np.random.default_rng(4)
    tables = [Stations(PLACES, exponential(PLACES) * np.exp(rng.normal(0, 0.05, (7, 3)))) for _ in range(300)]
    usual = np.sqrt(np.mean([leave_one_out(table) ** 2 for table in tables], axis=0))
    inside = [(low <= usual) & (usual <= high) for low, high in map(leave_one_out_interval, tables)]
    assert 0.9 <= np.mean(inside) <= 1.0


def test_each_stations_own_error_is_signed():
    stations = Stations(PLACES, exponential(PLACES) * np.where(np.arange(7) == 3, 1.2, 1.0)[:, None])
    errors = left_out(stations)
    np.testing.assert_allclose(errors[3], 1 / 1.2 - 1, rtol=1e-9)
    np.testing.assert_allclose(np.sqrt((errors**2).mean(axis=0)), leave_one_out(stations))


def leaning(places, turn=0.0):
    """Matrices (n, 3, 3) whose principal stiffnesses change exponentially, axes turned about y."""
    c, s = np.cos(turn), np.sin(turn)
    axes = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    return axes @ (exponential(places)[..., None] * np.eye(3)) @ axes.T


def test_without_stiffness_across_a_matrix_is_interpolated_as_its_diagonal():
    places = grid(3)
    diagonal = domed(places)
    scalar, matrix = Stations(places, diagonal), Stations(places, diagonal[:, :, None] * np.eye(3))
    place = np.array([0.13, 0.22, 0.05])
    np.testing.assert_allclose(
        stiffness_at(matrix, place).value, np.diag(stiffness_at(scalar, place).value), rtol=1e-9, atol=1e-3
    )
    np.testing.assert_allclose(
        np.diagonal(left_out(matrix), axis1=1, axis2=2), left_out(scalar), rtol=1e-6, atol=1e-9
    )


def test_a_machine_in_another_frame_has_the_turned_matrix_between_its_stations_too():
    place = np.array([-0.1, 0.03, -0.2])
    found = stiffness_at(Stations(PLACES, leaning(PLACES, 0.3)), place)
    np.testing.assert_allclose(found.value, leaning(place, 0.3), rtol=1e-9, atol=1e-2)


def test_unlike_stiffness_across_stays_unlike():
    follower = np.array([[2.0, 0.3, 0.0], [0.1, 2.0, 0.0], [0.0, 0.0, 5.0]]) * 1e6
    stations = Stations(PLACES, np.tile(follower, (7, 1, 1)))
    np.testing.assert_allclose(stiffness_at(stations, PLACES[0]).value, follower, rtol=1e-9, atol=1e-3)
