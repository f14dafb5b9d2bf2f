"""Knees of simulated cuts, whole and cut short."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from metro.signals.segmentation import knees

PLACE = np.arange(0.0, 120.0, 1.0)
LEVEL = np.array([80.0, -170.0, -35.0])


def cut(seed, knots=(12.0, 20.0, 104.0, 111.0), sd=6.0, walk=0.5):
    rng = np.random.default_rng(seed)
    shape = np.interp(PLACE, knots, [0, 1, 1, 0])
    wander = np.cumsum(rng.normal(0, walk, (len(PLACE), 3)), axis=0)
    return shape[:, None] * (LEVEL + wander) + rng.normal(0, sd, (len(PLACE), 3))


def test_the_knees_of_a_whole_cut_are_found_within_a_bin_or_two():
    found = np.array([list(vars(knees(PLACE, cut(seed))).values()) for seed in range(25)], dtype=float)
    np.testing.assert_allclose(found.mean(axis=0), [12, 20, 104, 111], atol=0.5)
    assert (found.std(axis=0) < 1.5).all()


@pytest.mark.parametrize(("part", "air"), [(slice(40, 90), 0), (slice(0, 90), 12), (slice(40, 120), 9)])
def test_what_a_log_does_not_show_is_not_made_up(part, air):
    for seed in range(10):
        found = knees(PLACE[part], cut(seed)[part])
        names = found.names(PLACE[part])
        assert (found.begins is not None) == (part.start < 12)
        assert (found.left is not None) == (part.stop > 111)
        assert np.sum(names == "air") == pytest.approx(air, abs=2)


def test_every_place_has_a_name_in_the_order_of_a_cut():
    names = knees(PLACE, cut(3)).names(PLACE)
    order = [names[0], *(b for a, b in pairwise(names) if a != b)]
    assert order == ["air", "cut-in", "steady", "cut-out", "air"]
