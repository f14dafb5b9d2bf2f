"""The weight of an arm by its idle runs, on logs whose torques are made from its potential energy."""

import numpy as np
import pytest

from metro.observables.arm.idle_runs import carried_weight
from metro.observables.problem import Refusal
from metro.robot.friction import of_idle_runs
from metro.robot.kinematics import arm_of_cell, link_frames

DH = [[0, 90, 500, 250], [90, 0, 0, 610], [-180, -90, 0, 70], [0, 90, 710, 0], [0, -90, 0, 0], [0, 0, 215, 0]]
ARM = arm_of_cell({"arm": {"dh": DH}}, {})
STEP = 2.1e-6  # rad
MASSES = np.array([320.0, 240.0, 60.0, 90.0, 15.0, 25.0])
START = np.radians([-20.3, -13.9, -4.4, -61.7, 34.9, 56.7])


def holding(q, step=1e-6):
    """Torques (m, 6) that hold the arm: how its potential energy rises with each joint."""

    def energy(q):
        return 9.81 * link_frames(ARM.dh, q)[:, 1:, 2, 3] @ MASSES

    return np.stack([(energy(q + step * e) - energy(q - step * e)) / (2 * step) for e in np.eye(6)], axis=-1)


def idle(rng, turns, seconds=11.3):
    """Log of a path on which each joint turns by ``turns`` (6,) rad, with friction and noise, of encoders."""
    t = np.arange(0.0, seconds, 0.012)
    q = START + np.round(np.outer(t / seconds, turns) / STEP) * STEP
    friction = np.array([160, 190, 130, 45, 38, 26.0]) * np.sign(turns)
    return t, q, holding(q) + friction + rng.normal(0.0, 2.0, q.shape)


@pytest.mark.parametrize("seed", range(4))
def test_how_the_weight_changes_along_a_path_is_that_of_the_potential_energy(seed):
    rng = np.random.default_rng(seed)
    paths = [idle(rng, sign * np.array([0.1, 0.12, -0.15, 0.2, -0.1, 0.3])) for sign in (1.0, -1.0)]
    found = of_idle_runs(ARM.dh, paths)
    q = paths[0][1]
    weight, truth = carried_weight(found, ARM.dh, q), -holding(q)
    change, true_change = weight - weight[len(q) // 2], truth - truth[len(q) // 2]
    assert np.ptp(true_change[:, 1]) > 100.0
    np.testing.assert_allclose(change, true_change, atol=0.02 * np.abs(true_change).max())


def test_without_idle_runs_nothing_is_known_of_it():
    assert not carried_weight(Refusal("no run has an idle_log"), ARM.dh, np.tile(START, (5, 1))).any()


def test_away_from_the_idle_runs_it_is_not_known():
    """What torques of one path do not determine is anything elsewhere."""
    turns = np.array([0.1, 0.12, -0.15, 0.2, -0.1, 0.3])
    found = of_idle_runs(ARM.dh, [idle(np.random.default_rng(1), turns)])
    near = START + np.linspace(0.1, 0.9, 20)[:, None] * turns
    assert np.ptp(carried_weight(found, ARM.dh, near)[:, 1]) > 50.0
    assert not carried_weight(found, ARM.dh, near + np.array([0.0, 0.0, 0.2, 0.0, 0.0, 0.0])).any()
    leaving = near + np.linspace(0.0, 0.2, 20)[:, None] * np.eye(6)[2]
    assert not carried_weight(found, ARM.dh, leaving).any()


def test_idle_runs_without_torques_show_none():
    t, q, torque = idle(np.random.default_rng(1), np.array([0.1, 0.12, -0.15, 0.2, -0.1, 0.3]))
    nothing = np.full_like(torque, np.nan)
    with pytest.raises(ValueError, match="SVD did not converge"):
        of_idle_runs(ARM.dh, [(t, q, nothing)])
