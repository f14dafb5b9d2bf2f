"""The turn over which friction follows a joint, and its state at the start of a path, from idle runs."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from metro.robot.presliding import IdlePath, presliding
from metro.signals.waves import variance

LEVEL, NOISE, COUNT = 22.0, 0.1, 200
SLOW = 8.0  # s of a path, of which the joint creeps at first


def _path(rng, turn, before, faster=0.0, level=LEVEL):
    """Torque of a joint that creeps at first, by Dahl's equation in small steps of another package."""
    t = np.linspace(0.0, SLOW, COUNT)

    def rate(at):
        return 3e-4 + faster + 4e-3 * (at / SLOW) ** 2

    def slope(at, state):
        return (1.0 - state) * rate(at) / turn

    state = solve_ivp(slope, (0.0, SLOW), [before], t_eval=t, max_step=1e-2, rtol=1e-8).y[0]
    q = np.array([(3e-4 + faster) * at + 4e-3 * at**3 / (3.0 * SLOW**2) for at in t])
    weight = 40.0 - 3.0 * t / SLOW + 0.5 * (t / SLOW) ** 2
    torque = weight + level * state + NOISE * rng.normal(size=COUNT)
    sd = np.sqrt(variance(COUNT, np.array([NOISE**2]), np.zeros(1)))[:, 0]
    return IdlePath(q, rate(t), torque, sd)


@pytest.mark.parametrize("turn", [2e-4, 3.5e-4, 5e-4])
def test_a_joint_that_comes_from_the_other_side_shows_its_state_and_the_turn_over_which_it_follows(turn):
    rng = np.random.default_rng(5)
    befores = (-1.0, -0.4, 1.0)
    found = presliding([_path(rng, turn, before) for before in befores])
    assert found.turn == pytest.approx(turn, rel=0.1)
    np.testing.assert_allclose(found.start, befores, atol=0.1)


def test_a_joint_that_moves_as_before_says_nothing_of_the_turn_and_is_taken_as_it_moves():
    rng = np.random.default_rng(6)
    found = presliding([_path(rng, 5e-4, 1.0, faster=0.05) for _ in range(4)])
    assert np.isnan(found.turn)
    np.testing.assert_allclose(found.start, 1.0, atol=0.25)


def test_a_joint_without_friction_is_taken_as_it_moves():
    rng = np.random.default_rng(7)
    found = presliding([_path(rng, 5e-4, -1.0, level=0.0) for _ in range(4)])
    assert np.isnan(found.turn)
    assert (found.start > 0.0).all()


def test_torques_that_do_not_change_are_no_friction():
    path = _path(np.random.default_rng(8), 5e-4, -1.0)
    still = IdlePath(path.q, path.rate, np.full(COUNT, 3.0), path.sd)
    found = presliding([still])
    assert np.isnan(found.turn)
    assert found.start == pytest.approx([1.0])
