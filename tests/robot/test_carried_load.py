"""The load of two logs: point masses moved by virtual work, gains and friction that nobody is told of."""

from functools import cache

import numpy as np
import pytest
from free_arm import CENTRE, DH, MASS, NOISE, bare, of_the_load
from scipy.stats import t as student

from metro.robot.carried_load import carried_load, of_logs, of_pair
from metro.robot.joint_dynamics import free_motion
from metro.robot.same_motion import pair_of

TIME = np.arange(0, 32, 0.01)
SHIFT = 0.7342
STEP = 1e-4  # rad, of the encoders


@cache
def parts(seed, shift):
    time = TIME - shift
    return *bare(time, seed), of_the_load(time, seed)


def log(*, loaded, seed=1, shift=0.0, gain=0.0, loss=0.0, noise=0.0, rng=None):
    """A log whose gears lose a share ``loss`` of the torque that they carry, read with wrong constants."""
    q, rate, links, friction, load = parts(seed, shift)
    carried = links + load * loaded
    torque = carried + friction + loss * np.abs(carried) * np.sign(rate)
    if rng is not None:
        torque = torque + noise * NOISE * rng.normal(size=torque.shape)
    return TIME, np.round(q / STEP) * STEP, torque * (1 + np.asarray(gain))


def two(**how):
    return log(loaded=False, **how), log(loaded=True, shift=SHIFT, **how)


def found(logs, drives):
    pair = pair_of(*logs)
    return carried_load([of_pair(DH, pair, joint) for joint in range(6)], drives)


def test_the_clocks_of_two_logs_of_one_motion_are_brought_together():
    pair = pair_of(*two())
    assert pair.shift == pytest.approx(SHIFT, abs=1e-4)
    assert (pair.apart < STEP).all()


def test_logs_of_different_motions_are_no_pair():
    assert pair_of(log(loaded=False), log(loaded=True, seed=2)) is None


def test_without_errors_mass_and_centre_are_those_of_the_points():
    load = found(two(), np.zeros((6, 6)))
    assert load.carried.mass == pytest.approx(MASS, rel=2e-3)
    assert load.carried.centre == pytest.approx(CENTRE, abs=5e-4)


def test_friction_in_proportion_to_the_load_is_no_mass():
    """The load is off by less than a fifth of what the gears lose."""
    load = found(two(loss=0.07), np.zeros((6, 6)))
    assert load.carried.mass == pytest.approx(MASS, rel=0.07 / 5)


def test_logs_of_different_motions_tell_the_load_too():
    logs = [log(loaded=False), log(loaded=True, seed=2)]
    moved = [free_motion(*each) for each in logs]
    evidence = [of_logs(DH, moved, [False, True], joint) for joint in range(6)]
    assert carried_load(evidence, np.zeros((6, 6))).carried.mass == pytest.approx(MASS, rel=0.02)


def test_an_error_that_all_constants_share_is_in_the_interval_and_one_joint_cannot_show_it():
    drives = np.full((6, 6), 0.08**2)
    load = found(two(gain=-0.1), drives)
    assert load.carried.mass == pytest.approx(0.9 * MASS, rel=5e-3)
    assert np.sqrt(load.carried.covariance[0, 0]) == pytest.approx(0.08 * load.carried.mass, rel=0.05)
    assert load.by_joint[1:5, 0] == pytest.approx(1.0, abs=0.02)


def test_constants_that_do_not_agree_widen_the_interval_though_none_is_declared():
    gain = np.array([0.0, 0.08, -0.08, 0.06, -0.05, 0.0])
    exact, apart = (found(two(gain=g), np.zeros((6, 6))) for g in (0.0, gain))
    assert apart.scatter == pytest.approx(0.07, abs=0.03)
    assert apart.carried.covariance[0, 0] > 9 * exact.carried.covariance[0, 0]


def test_intervals_hold_the_mass_as_often_as_they_say():
    """Were they right, fewer than 35 of 40 would be held in 3 of 100 such tests."""
    rng, held = np.random.default_rng(8), 0
    shared, own = 0.08, 0.03
    drives = shared**2 + own**2 * np.eye(6)
    for _ in range(40):
        gain = shared * rng.normal() + own * rng.normal(size=6)
        carried = found(two(gain=gain, loss=0.05, noise=1.0, rng=rng), drives).carried
        half = student.ppf(0.975, carried.dof) * np.sqrt(carried.covariance[0, 0])
        held += abs(carried.mass - MASS) <= half
    assert held >= 35


def test_a_flange_that_is_never_tilted_does_not_tell_the_load():
    still = (TIME, np.zeros((len(TIME), 6)), np.ones((len(TIME), 6)))
    turning = np.zeros((len(TIME), 6))
    turning[:, 0] = np.sin(TIME)
    logs = [(TIME, turning, still[2] * k) for k in (1.0, 2.0)]
    with pytest.raises(ValueError, match="does not determine mass and centre"):
        found(logs, np.zeros((6, 6)))
