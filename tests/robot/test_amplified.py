"""Ripples that the arm's first mode amplifies: against the equation of motion, step by step."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from metro.robot.amplified import AmplifiedRipple, Structure

ORDER, FIRST, SECOND = 900.0, (30.0, -12.0), (4.0, 7.0)
HZ, DAMPING = 9.0, 0.07


def ripple(hz=HZ, damping=DAMPING):
    return AmplifiedRipple(0, ORDER, FIRST, SECOND, Structure(hz, damping))


def torque(angle):
    """Of the gear alone, as a table of it would have it."""
    first = FIRST[0] * np.sin(ORDER * angle) + FIRST[1] * np.cos(ORDER * angle)
    return first + SECOND[0] * np.sin(2 * ORDER * angle) + SECOND[1] * np.cos(2 * ORDER * angle)


def path(speed, seconds, start=0.2):
    t = np.arange(0.0, seconds, 1e-3)
    q = start + speed * t
    return t, q[:, None], np.full((len(t), 1), speed)


@pytest.mark.parametrize("speed", [0.01, 0.03, 0.05, 0.063, 0.2, -0.03, -0.063])
def test_the_tip_moves_as_a_mass_on_a_spring_whose_support_the_joint_moves(speed):
    t, q, pace = path(speed, 6.0)
    omega = 2 * np.pi * HZ

    def moved(at, state):
        x, v = state
        return [v, omega**2 * (torque(0.2 + speed * at) - x) - 2 * DAMPING * omega * v]

    whole = solve_ivp(moved, (0.0, 6.0), [0.0, 0.0], t_eval=t, rtol=1e-9, atol=1e-9)
    steady = t > 4.0
    found = ripple().at(q, pace)
    assert np.abs(found - whole.y[0])[steady].max() < 1e-4 * np.abs(found).max()


def test_a_stiff_arm_shows_the_torque_itself():
    _, q, pace = path(0.03, 2.0)
    np.testing.assert_allclose(ripple(hz=1e6).at(q, pace), torque(q[:, 0]), atol=1e-4)


def test_a_slow_joint_is_not_amplified_and_a_quick_one_is_left_behind():
    for speed, gain in ((1e-4, 1.0), (3.0, 0.0)):
        _, q, pace = path(speed, 3.0 if speed > 1 else 200.0)
        ratio = np.ptp(ripple().at(q, pace)) / np.ptp(torque(q[:, 0]))
        assert ratio == pytest.approx(gain, abs=0.01)
