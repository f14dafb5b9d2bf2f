"""The lowest cut over a place: its limits, and that a face changes with each cut by its share."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.surface.lowest_cut import KINK, lowest_cut
from metro.units import UM

HEIGHTS = st.lists(st.floats(-5.0, 5.0), min_size=4, max_size=4)


@given(HEIGHTS)
@settings(deadline=None)  # it is compiled when it is first called
def test_a_place_is_no_higher_than_its_lowest_cut_and_lower_by_no_more_than_kinks(heights):
    height = np.array([heights]) * UM
    share, finished = lowest_cut(height, np.ones((1, 4), dtype=bool))
    assert share.sum() == pytest.approx(1.0)
    lower = height.min() - finished[0]
    assert -1e-15 <= lower <= KINK * np.log(4.0) + 1e-15
    assert finished[0] == pytest.approx(
        -KINK * np.log(np.exp(-(height - height.min()) / KINK).sum()) + height.min()
    )


@given(HEIGHTS, st.integers(0, 3))
@settings(deadline=None)
def test_a_place_changes_with_a_cut_by_its_share(heights, which):
    height, step = np.array([heights]) * UM, 1e-4 * UM
    valid = np.ones((1, 4), dtype=bool)
    moved = step * (np.arange(4) == which)
    share, _ = lowest_cut(height, valid)
    slope = (lowest_cut(height + moved, valid)[1] - lowest_cut(height - moved, valid)[1]) / (2.0 * step)
    assert slope[0] == pytest.approx(share[0, which], abs=1e-5)


def test_a_cut_that_was_not_made_finishes_nothing_and_a_place_without_any_is_their_mean():
    height = np.array([[3.0, 1.0, -9.0], [3.0, 1.0, 2.0]]) * UM
    share, finished = lowest_cut(height, np.array([[True, True, False], [False, False, False]]))
    np.testing.assert_allclose(share[0], [np.exp(-2.0 * UM / KINK), 1.0, 0.0], atol=1e-8)
    np.testing.assert_allclose(share[1], 1.0 / 3.0)
    np.testing.assert_allclose(finished, [1.0 * UM, 2.0 * UM], atol=1e-14)
