"""Even places and clocks against those with gaps and jitter."""

import numpy as np

from metro.signals.intervals import UNEVEN, places, uneven


def test_even_places_need_no_other_walk_and_gaps_and_jitter_do():
    assert uneven(0.012 * np.arange(50) + 3.0) is None
    assert uneven(np.array([1.0])) is None
    place = np.arange(50.0)
    place[20] += 0.9 * UNEVEN
    assert uneven(place) is None
    place[20] += 0.2 * UNEVEN
    np.testing.assert_allclose(uneven(place)[[18, 19, 20]], [1.0, 1.0 + 1.1 * UNEVEN, 1.0 - 1.1 * UNEVEN])
    place = np.delete(0.5 * np.arange(50), [7, 8])
    np.testing.assert_allclose(uneven(place)[[5, 6, 7]], [1.0, 3.0, 1.0])


def test_places_run_from_minus_one_to_one_with_the_gaps_where_they_are():
    np.testing.assert_array_equal(places(5, None), np.linspace(-1.0, 1.0, 5))
    np.testing.assert_allclose(places(4, np.array([1.0, 6.0, 1.0])), [-1.0, -0.75, 0.75, 1.0])
