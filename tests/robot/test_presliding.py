"""The turn over which friction follows a joint, and its state at the start of a path, from idle runs."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from metro.robot.presliding import IdlePath, presliding
from metro.signals.waves import variance

LEVEL, NOISE, COUNT = 22.0, 0.3, 200
SLOW = 8.0  # s of a path, of which the joint creeps at first


def _path(rng, turn, before, rate, level=LEVEL):
    """Torque of a joint of a speed that depends on time, by Dahl's equation in small steps of SciPy."""

    def slope(at, both):
        speed = rate(at)
        return speed, (np.sign(speed) - both[1]) * abs(speed) / turn

    t = np.linspace(0.0, SLOW, COUNT)
    q, state = solve_ivp(slope, (0.0, SLOW), [0.0, before], t_eval=t, max_step=5e-2, rtol=1e-8).y
    weight = 40.0 - 3.0 * t / SLOW + 0.5 * (t / SLOW) ** 2
    torque = weight + level * state + NOISE * rng.normal(size=COUNT)
    sd = np.sqrt(variance(COUNT, np.array([NOISE**2]), np.zeros(1)))[:, 0]
    return IdlePath(q, np.array([rate(at) for at in t]), torque, sd)


def _creeping(at):
    """Speed of a joint that creeps at first, rad/s."""
    return 3e-4 + 4e-3 * (at / SLOW) ** 2


def _fast(at):
    return 0.05 + _creeping(at)


def _turning_round(at):
    return 4e-3 * (1.0 - 2.0 * at / SLOW)


def _standard_errors(turn, befores):
    """Errors of the states and of the turn by the Cramér-Rao bound, from the paths without noise."""
    paths = [*((before, _creeping) for before in befores), (1.0, _turning_round)]
    polynomials = np.kron(np.eye(len(paths)), np.polynomial.legendre.legvander(np.linspace(-1, 1, COUNT), 4))

    def torques(level, turn, *before):
        silent = _Silent()
        each = zip((*before, 1.0), (speed for _, speed in paths), strict=True)
        return np.concatenate([_path(silent, turn, one, speed, level).torque for one, speed in each])

    at = np.array([LEVEL, turn, *befores])
    steps = np.diag(1e-3 * np.array([LEVEL, turn, *np.ones(len(befores))]))
    slopes = [(torques(*(at + step)) - torques(*(at - step))) / (2.0 * step.sum()) for step in steps]
    jacobian = np.column_stack([*slopes, polynomials])
    errors = NOISE * np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    return errors[2 : 2 + len(befores)], errors[1]


class _Silent:
    """A generator of no noise."""

    def normal(self, size):
        return np.zeros(size)


@pytest.mark.parametrize("turn", [2e-4, 3.5e-4, 5e-4, 1e-3])
def test_a_joint_that_comes_from_the_other_side_shows_its_state_and_the_turn_over_which_it_follows(turn):
    """A run in which the joint turns round shows the level, without which no state is known by itself."""
    errors, turns, befores, seeds = [], [], np.array([-0.8, -0.4, 0.3]), 12
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        paths = [_path(rng, turn, before, _creeping) for before in befores]
        found = presliding([*paths, _path(rng, turn, 1.0, _turning_round)])
        turns.append(found.turn - turn)
        errors.append(found.start[:3] - befores)
    of_states, of_turn = _standard_errors(turn, befores)
    worst = 4.0  # standard errors: one case in 16000 by chance
    assert np.abs(turns).max() < worst * of_turn
    assert (np.abs(errors) < worst * of_states).all()
    assert (np.abs(np.mean(errors, axis=0)) < worst * of_states / np.sqrt(seeds)).all()
    assert of_states.max() < 1.0  # so that the states are known at all


def test_a_joint_that_moves_as_before_says_nothing_of_the_turn_and_is_taken_as_it_moves():
    rng = np.random.default_rng(6)
    found = presliding([_path(rng, 5e-4, 1.0, _fast) for _ in range(4)])
    assert np.isnan(found.turn)
    np.testing.assert_allclose(found.start, 1.0, atol=0.25)


def test_a_joint_without_friction_is_taken_as_it_moves():
    rng = np.random.default_rng(7)
    found = presliding([_path(rng, 5e-4, -1.0, _creeping, level=0.0) for _ in range(4)])
    assert np.isnan(found.turn)
    assert (found.start > 0.0).all()


def test_torques_that_do_not_change_are_no_friction():
    path = _path(np.random.default_rng(8), 5e-4, -1.0, _creeping)
    still = IdlePath(path.q, path.rate, np.full(COUNT, 3.0), path.sd)
    found = presliding([still])
    assert np.isnan(found.turn)
    assert found.start == pytest.approx([1.0])


@pytest.mark.parametrize("before", [-0.9, -0.4, 0.5, 1.0])
def test_a_joint_that_hardly_moves_begins_in_the_state_that_is_seen_where_its_weight_is_known(before):
    """Along the path nothing of its torque changes, so that only the weight tells friction from it."""
    rng = np.random.default_rng(9)

    def hardly(at):
        return 1e-6 * (1.0 + at / SLOW)

    others = [_path(rng, 3e-4, 1.0, _turning_round) for _ in range(3)]
    path = _path(rng, 3e-4, before, hardly)
    t = np.linspace(0.0, SLOW, COUNT)
    weight = 40.0 - 3.0 * t / SLOW + 0.5 * (t / SLOW) ** 2
    seen = replace(path, rubbed=(path.torque - weight) / LEVEL)
    assert presliding([*others, seen]).start[-1] == pytest.approx(before, abs=0.05)
