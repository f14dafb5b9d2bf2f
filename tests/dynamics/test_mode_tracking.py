"""Modes followed over places: made-up modes that change, cross, and are missing in between."""

import numpy as np
import pytest

from metro.dynamics.tracking import Seen, follow

POINTS = tuple("abcd")
SHAPES = np.array([[1.0, 0.8, 0.5, 0.2], [1.0, 0.3, -0.5, -0.4], [1.0, -0.4, -0.3, 0.6]])
LINE = np.abs(np.subtract.outer(np.arange(4.0), np.arange(4.0)))


def seen(frequency, shapes=SHAPES, points=POINTS, keep=None):
    """Modes by rising frequency, the shape of each with it."""
    frequency = np.asarray(frequency, dtype=float)
    order = np.argsort(frequency)
    order = order if keep is None else [i for i in order if i in keep]
    return Seen(frequency[order], shapes[order].astype(complex), points)


def names(tests, distance=None):
    return [track.number.tolist() for track in follow(tests, distance)]


def test_modes_that_hardly_change_keep_their_numbers():
    tests = [seen(np.array([20.0, 35.0, 60.0]) * factor) for factor in (1.0, 1.05, 0.97)]
    assert names(tests) == [[1, 2, 3]] * 3
    assert follow(tests)[1].alike == pytest.approx(1.0)


def test_modes_that_cross_are_told_apart_by_their_shapes():
    tests = [seen([20.0, 50.0, 56.0]), seen([20.0, 53.0, 54.0]), seen([20.0, 56.0, 51.0])]
    # the third test has them in the other order by frequency
    assert names(tests) == [[1, 2, 3], [1, 2, 3], [1, 3, 2]]


def test_without_enough_points_frequency_alone_counts():
    few = [
        Seen(one.frequency, one.shape[:, :2], POINTS[:2])
        for one in (seen([20.0, 50.0, 56.0]), seen([20.0, 56.0, 51.0]))
    ]
    tracks = follow(few)
    assert tracks[1].number.tolist() == [1, 2, 3]
    assert np.isnan(tracks[1].alike).all()


def test_a_mode_that_was_missed_leaves_its_number_free():
    tests = [seen([20.0, 35.0, 60.0]), seen([20.0, 35.0, 60.0], keep=(0, 2))]
    assert names(tests) == [[1, 2, 3], [1, 3]]


def test_a_mode_that_only_one_place_has_is_a_mode_of_its_own():
    more = np.vstack([SHAPES, [[1.0, 0.9, -0.9, 0.8]]])
    tests = [seen([20.0, 35.0, 60.0]), seen([20.0, 35.0, 60.0, 120.0], more)]
    assert names(tests) == [[1, 2, 3], [1, 2, 3, 4]]


def test_a_mode_of_another_shape_is_not_the_same_however_near():
    other = SHAPES.copy()
    other[2] = [1.0, 0.2, 1.0, -1.2]  # hardly alike to any
    tracks = follow([seen([20.0, 35.0, 60.0]), seen([20.0, 35.0, 60.5], other)])
    assert tracks[1].number.tolist()[:2] == [1, 2]
    assert tracks[1].number[2] == 4
    assert np.isnan(tracks[1].alike[2])


def test_each_place_follows_its_nearest_neighbour():
    """From end to end the frequencies change by more than a pair may differ, from place to place by less."""
    tests = [seen(np.array([20.0, 35.0, 90.0]) * 1.15**i) for i in range(4)]
    shuffled, places = [tests[i] for i in (0, 3, 1, 2)], np.array([0, 3, 1, 2])
    tracks = follow(shuffled, LINE[np.ix_(places, places)])
    assert [track.number.tolist() for track in tracks] == [[1, 2, 3]] * 4
    assert [track.before for track in tracks] == [-1, 3, 0, 2]


def test_points_that_both_places_have_make_the_shape():
    partly = Seen(np.array([20.0, 50.0, 56.0]), np.roll(SHAPES, 1, axis=1).astype(complex), (*"dabc",))
    assert follow([seen([20.0, 50.0, 56.0]), partly])[1].alike == pytest.approx(1.0)


def test_nothing_is_followed_where_there_is_nothing():
    assert follow([]) == []
