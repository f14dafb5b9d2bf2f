"""The simulated hybrid machine: what is said of it holds over its workspace."""

import numpy as np
import pytest

from virtual_cell.hybrid import MIDDLE_MM, end_stiffness, modes_at, positions, shapes
from virtual_cell.recipes.trimule import MODES
from virtual_cell.recipes.trimule_structure import SEVEN

PLACES = positions(SEVEN)


def test_there_are_73_positions_none_of_them_twice():
    assert len(PLACES) == 73
    at = np.stack(list(PLACES.values()))
    apart = np.linalg.norm(at[:, None] - at, axis=2) + 1e9 * np.eye(73)
    assert apart.min() > 30.0
    np.testing.assert_array_equal(PLACES["5"], [-400.0, 0.0, -320.0])


@pytest.mark.parametrize("place", PLACES.values(), ids=PLACES)
def test_the_end_resists_most_along_y_and_more_in_the_middle(place):
    here, middle = end_stiffness(place), end_stiffness(MIDDLE_MM)
    np.testing.assert_allclose(here, here.T, rtol=1e-12)
    assert np.diag(here).argmax() == 1
    assert np.linalg.eigvalsh(here)[0] > 0
    assert (np.linalg.eigvalsh(here) <= np.linalg.eigvalsh(middle) * (1 + 1e-12)).all()


@pytest.mark.parametrize("name", SEVEN)
def test_the_modes_add_up_to_the_compliance_of_the_end(name):
    """In proportion to the first position, where the source prints the modes and not the stiffness."""
    first, place = np.array(SEVEN["1"]), np.array(SEVEN[name])
    ratio = np.diag(np.linalg.inv(end_stiffness(place))) / np.diag(np.linalg.inv(end_stiffness(first)))
    for direction, modes in modes_at(place, MODES, first).items():
        own = np.sum(1 / modes.stiffness) / np.sum(1 / MODES[direction].stiffness)
        assert own == pytest.approx(ratio["xyz".index(direction)])


def test_at_the_first_position_the_modes_are_those_that_are_printed():
    first = np.array(SEVEN["1"])
    for direction, modes in modes_at(first, MODES, first).items():
        np.testing.assert_allclose(modes.damped, MODES[direction].damped)
        np.testing.assert_allclose(modes.stiffness, MODES[direction].stiffness)


def test_shapes_are_one_at_the_tip_and_small_at_the_base():
    shape = shapes(np.array(SEVEN["1"]), 4)
    np.testing.assert_array_equal(shape[0], 1.0)
    assert np.abs(shape[-1]).max() < 0.2
