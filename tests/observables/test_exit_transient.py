"""What remains of a step as a cutter leaves the block, against a convolution in small steps."""

import numpy as np
import pytest

from metro.observables.flatness.path import Pace, Passages
from metro.observables.flatness.setup import Setup, left

RADIUS = 0.01


def convolved(length, end, count=200_001):
    """Remainder at even places from where the front leaves: every fall of the force decays by itself."""
    way = np.linspace(0.0, end, count)
    along = np.clip(1.0 - way / RADIUS, 0.0, 1.0)
    gone = np.sqrt(1.0 - along**2)  # of half the width of the cutter
    step, total, remains = way[1], 0.0, np.zeros(count)
    kept = np.exp(-step / length)
    for i in range(1, count):
        total = total * kept + (gone[i] - gone[i - 1])
        remains[i] = total
    return way, remains


@pytest.mark.parametrize("length", [0.003, 0.02])
def test_each_part_of_the_step_decays_by_itself(length):
    way, remains = convolved(length, 3.0 * RADIUS)
    places = np.linspace(0.0, 3.0 * RADIUS, 57)
    expected = np.interp(places, way, remains)
    assert np.abs(left(places - RADIUS, RADIUS, length) - expected).max() < 2e-3


def test_nothing_is_left_before_the_front_leaves_and_all_of_a_step_that_does_not_decay():
    outside = np.array([[-0.05, -RADIUS, 0.0, 0.04]])
    np.testing.assert_allclose(left(outside, RADIUS, 1e3), [[0.0, 0.0, 1.0, 1.0]], atol=2e-3)


def test_a_transient_begins_at_the_edge_of_the_block_and_decays_behind_it():
    edge, length = np.array([0.012]), 0.02
    pace = Pace(0.04, 5.0, edge, edge + 0.1, RADIUS)
    along = np.array([[0.0, 0.0119, 0.0121, 0.032]])
    zero = np.zeros_like(along)
    passages = Passages(zero, zero, zero, np.zeros(along.shape, dtype=np.intp), along, zero == 0.0)
    higher = Setup(entry=((5e-6, length, 0.0),)).cuts(zero[:, 0], zero[:, 0], passages, pace, force=100.0)
    np.testing.assert_allclose(higher, [[0.0, 0.0, 5e-6 * np.exp(-0.005), 5e-6 * np.exp(-1.0)]], rtol=1e-9)
