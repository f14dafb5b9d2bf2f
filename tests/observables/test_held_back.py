"""What an arm holds back of a load: by tests at small and at large loads, and where these cannot say."""

import numpy as np
import pytest

from metro.observables.flatness.beliefs import FORCE, FORCE_SD, believed_block
from metro.observables.flatness.held import LOST, held_back
from metro.observables.flatness.pose_field import PoseField
from metro.observables.problem import Parameter
from metro.surface.tip_stiffness import Rows, basis_over

COMPLIANCE = 1.5e-6  # m/N


def pulls(loads, held, noise, seed=0):
    """Return the field of a face and pulls along z at nine points of it, each load less ``held`` newtons."""
    rng = np.random.default_rng(seed)
    x, y = (axis.ravel() for axis in np.meshgrid([0.0, 0.1, 0.2], [0.0, 0.05, 0.1]))
    at_x, at_y, size = np.repeat(x, len(loads)), np.repeat(y, len(loads)), np.tile(loads, len(x))
    force = size[:, None] * np.array([0.0, 0.0, 1.0])
    moved = COMPLIANCE * (1.0 + 0.4 * at_x) * (size - held * np.sign(size))
    moved = moved + rng.normal(0.0, noise, len(moved))
    field = PoseField("A", basis_over(at_x, at_y, 3), (False, False, True))
    return field, Rows(at_x, at_y, force, moved, np.full(len(moved), 2))


@pytest.mark.parametrize("held", [-6.0, -2.0, 3.0, 7.0])
def test_accurate_tests_at_many_loads_say_how_much_is_held(held):
    field, rows = pulls([50.0, 100.0, 150.0, 200.0, 250.0], held, 0.2e-6)
    assert held_back(field, rows, 0.2e-6) == pytest.approx(abs(held), rel=0.1)


def test_tests_at_one_load_say_nothing_and_leave_what_is_believed():
    field, rows = pulls([250.0, 250.0], 7.0, 0.2e-6)
    assert held_back(field, rows, 0.2e-6) == pytest.approx(LOST * 250.0, rel=1e-6)


def test_where_nothing_is_held_it_is_the_uncertainty_that_counts():
    """By repetition: the intercept of a line through scattered points, which a prior narrows little."""
    noise, loads = 4e-6, [50.0, 100.0, 150.0, 200.0, 250.0]
    said = [held_back(*pulls(loads, 0.0, noise, seed), noise) for seed in range(200)]
    found = []
    for seed in range(200):
        _, rows = pulls(loads, 0.0, noise, seed)
        size, place = np.abs(rows.force[:, 2]), 1.0 + 0.4 * rows.x
        slope, level = np.linalg.lstsq(np.column_stack([size * place, place]), rows.displacement)[0]
        found.append(-level / slope)
    spread = float(np.std(found))
    narrowed = 1.0 / np.hypot(1.0 / spread, 1.0 / (LOST * 250.0))
    # one draw's own mean comes on top of its standard deviation
    assert np.sqrt(np.mean(np.square(said))) == pytest.approx(np.sqrt(2.0) * narrowed, rel=0.15)


def test_friction_widens_what_is_believed_of_force_damping_and_frequencies_and_of_nothing_else():
    names = ("form_xx", FORCE, "loss_off_far", "ringing_off_far")
    believed = tuple(Parameter(name, "1", 1.0) for name in names)
    exact, held = (believed_block(believed, (), share).sigma for share in (0.0, 0.1))
    assert held[0] == exact[0]
    # An oscillator that friction slows: each cycle of amplitude a loses 4 h a of an energy of k a²/2.
    amplitude, stiffness, friction = 2.0, 5.0, 0.1 * 2.0 * 5.0
    ratio = 4.0 * friction * amplitude / (0.5 * stiffness * amplitude**2) / (4.0 * np.pi)
    # And before it slips, a spring beside that of the tip which reaches h at that amplitude.
    higher = np.sqrt(1.0 + friction / amplitude / stiffness) - 1.0
    for at, known, by_friction in ((1, FORCE_SD, 0.1), (2, exact[2], ratio), (3, exact[3], higher)):
        assert exact[at] == pytest.approx(known)
        assert held[at] == pytest.approx(np.hypot(known, by_friction), rel=0.03)
