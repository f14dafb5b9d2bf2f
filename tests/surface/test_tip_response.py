"""The tip's response to the force along a pass, against direct integration and static limits."""

import numpy as np
import pytest

from metro.surface.tip_response import tip_heights

MASS = np.array([[654.58, 0.0, 382.51], [0.0, 903.38, 0.0], [382.51, 0.0, 269.57]])
STIFFNESS = np.diag([3.32e5, 7.15e5, 8.77e5])
PERIOD, COUNT = 6.0, 2400


def ramped(on: float, off: float, ramp: float = 0.2) -> np.ndarray:
    t = np.arange(COUNT) * PERIOD / COUNT
    shape = np.clip((t - on) / ramp, 0, 1) - np.clip((t - off) / ramp, 0, 1)
    return shape[:, None] * np.array([-10.0, 120.0, 90.0])


def test_a_constant_force_gives_the_static_deflection() -> None:
    force = np.tile([10.0, 20.0, 30.0], (64, 1))
    expected = (np.linalg.inv(STIFFNESS) @ force[0])[2]
    found = tip_heights(MASS, STIFFNESS[None], 0.05, force=force, period=PERIOD)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_a_pass_rings_as_the_equations_of_motion_integrated_step_by_step() -> None:
    from scipy.integrate import solve_ivp
    from scipy.linalg import eigh

    square, shape = eigh(STIFFNESS, MASS)
    damping = MASS @ shape @ np.diag(2 * 0.08 * np.sqrt(square)) @ shape.T @ MASS
    force, t = ramped(0.5, 4.0), np.arange(COUNT) * PERIOD / COUNT
    inverse = np.linalg.inv(MASS)

    def motion(time: float, state: np.ndarray) -> np.ndarray:
        push = np.array([np.interp(time % PERIOD, t, part) for part in force.T])
        return np.concatenate([state[3:], inverse @ (push - damping @ state[3:] - STIFFNESS @ state[:3])])

    solved = solve_ivp(motion, (0, 2 * PERIOD), np.zeros(6), max_step=0.02, rtol=1e-7, t_eval=t + PERIOD)
    found = tip_heights(MASS, STIFFNESS[None], 0.08, force=force, period=PERIOD)[0]
    assert np.abs(found - solved.y[2]).max() < 0.01 * np.ptp(solved.y[2])


def test_each_pass_has_its_own_stiffness() -> None:
    force = ramped(0.5, 4.0)
    both = tip_heights(MASS, np.stack([STIFFNESS, 2 * STIFFNESS]), 0.05, force=force, period=PERIOD)
    alone = tip_heights(MASS, 2 * STIFFNESS[None], 0.05, force=force, period=PERIOD)
    np.testing.assert_allclose(both[1], alone[0])


def test_the_disc_takes_7_5_percent_of_a_wave_of_eight_radii() -> None:
    t = np.arange(COUNT) * PERIOD / COUNT
    force = np.outer(np.cos(2 * np.pi * 3 * t), [0.0, 0.0, 1.0])
    plain = tip_heights(MASS, STIFFNESS[None], 0.05, force=force, period=PERIOD)
    # 3 Hz at 36 mm/s is a wave of 12 mm; a disc of 1.5 mm radius takes 1.5/36 s to cross by its radius
    seen = tip_heights(MASS, STIFFNESS[None], 0.05, force=force, period=PERIOD, disc=1.5 / 36)
    assert np.ptp(seen) / np.ptp(plain) == pytest.approx(0.925, abs=0.002)
