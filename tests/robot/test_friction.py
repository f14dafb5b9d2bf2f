"""Friction found in logs that are made here, of pendulums with known friction."""

from dataclasses import replace

import numpy as np
import pytest

from metro.robot.friction import curvature, identify, of_idle_runs, rigid_columns, weight_columns
from metro.robot.motion import encoder_step, motion

PERIOD = 1e-3
STEP = 1e-6
LEVEL = np.array([[0.0, np.pi / 2, 0.0, 0.0], [0.0, 0.0, 0.0, 0.4]])
COULOMB, VISCOUS, OFFSET = 7.0, 3.0, 0.5


def journey(seconds=12.0, rest=0.0):
    """Angle of a joint (m,), rad, that swings with changing amplitude and stands still now and then."""
    t = np.arange(0, seconds, PERIOD)
    swing = 0.8 * np.sin(1.9 * t) + 0.4 * np.sin(3.1 * t + 0.5) * np.sin(0.3 * t)
    if rest:
        turns = np.abs(np.gradient(swing, PERIOD)) < rest
        clock = np.cumsum(np.where(turns, 0.0, PERIOD))
        swing = 0.8 * np.sin(1.9 * clock) + 0.4 * np.sin(3.1 * clock + 0.5) * np.sin(0.3 * clock)
        swing = np.convolve(np.pad(swing, 40, mode="edge"), np.ones(81) / 81, "valid")
    return swing


def torque(angle, curve, rng, noise=0.3, held=None):
    """Motor torque of a pendulum: weight, inertia, friction, and noise that is not white."""
    rate, acceleration = np.gradient(angle, PERIOD), np.gradient(np.gradient(angle, PERIOD), PERIOD)
    resists = curve(rate)
    if held is not None:
        still = np.abs(rate) < 1e-6
        resists = np.where(still, held, resists)
    white = rng.normal(0, noise, len(angle))
    coloured = 3.0 * np.convolve(white, np.exp(-np.arange(60) / 20) / 20, "same")
    return 12.0 * np.cos(angle) + 1.7 * acceleration + resists + OFFSET + coloured


def line(rate):
    return COULOMB * np.sign(rate) + VISCOUS * rate


def stribeck(rate):
    return line(rate) + 2.0 * np.sign(rate) * np.exp(-np.abs(rate) / 0.3)


def record(angle, drive):
    """Log of joint 2 of an arm whose joint 1 stands still; joint 2 turns about a horizontal axis."""
    q = np.column_stack([np.zeros_like(angle), np.round(angle / STEP) * STEP])
    return motion(q, np.column_stack([np.zeros_like(angle), drive]), PERIOD, 20.0)


def found_in(seed, curve=line, angle=None):
    angle = journey() if angle is None else angle
    log = record(angle, torque(angle, curve, np.random.default_rng(seed)))
    return log, rigid_columns(LEVEL, log)


def test_friction_is_found_and_what_the_arm_weighs_is_no_part_of_it():
    friction = identify(*found_in(1))
    np.testing.assert_allclose(friction.value[1], [COULOMB, VISCOUS, OFFSET], rtol=0.05, atol=0.1)
    low, high = friction.interval()[1].T
    assert (high - low < [0.6, 0.6, 0.6]).all()
    assert friction.noise[1] < 0.5


def test_the_intervals_hold_the_truth_as_often_as_they_say():
    hits = np.array(
        [
            np.abs(friction.value[1] - [COULOMB, VISCOUS, OFFSET])
            <= friction.interval()[1, :, 1] - friction.value[1]
            for friction in (identify(*found_in(seed)) for seed in range(60))
        ]
    )
    # 95 % of 60 is 57; fewer than 52 has a chance of 1 in 100
    assert (hits.sum(axis=0) >= 52).all()


def test_standstill_is_a_trap_for_the_sign_of_speed_and_is_kept_out():
    """At rest a joint is held by any torque within Coulomb friction, and rounding makes the speed's sign."""
    rng = np.random.default_rng(5)
    angle = journey(rest=0.6)
    held = COULOMB * np.clip(np.cumsum(rng.normal(0, 0.02, len(angle))), -0.9, 0.9)
    log = record(angle, torque(angle, line, rng, held=held))
    others = rigid_columns(LEVEL, log)
    share = np.mean(log.moving[:, 1])
    assert 0.4 < share < 0.8
    assert identify(log, others).value[1, 0] == pytest.approx(COULOMB, rel=0.05)
    naive = replace(log, moving=np.ones_like(log.moving), direction=np.sign(log.rate))
    assert identify(naive, others).value[1, 0] < 0.85 * COULOMB


def test_a_joint_that_never_turns_round_has_no_coulomb_friction_of_its_own():
    t = np.arange(0, 8.0, PERIOD)
    angle = 0.3 * t + 0.05 * np.sin(2.0 * t)
    log, others = found_in(1, angle=angle)
    friction = identify(log, others)
    assert np.isnan(friction.value[1, [0, 2]]).all()
    assert friction.value[1, 1] == pytest.approx(VISCOUS, abs=4 * friction.sd[1, 1])


def test_a_joint_that_never_moves_has_no_friction_at_all():
    friction = identify(*found_in(1))
    assert np.isnan(friction.value[0]).all()


def test_an_arm_at_rest_is_refused():
    log, others = found_in(1, angle=np.zeros(12000))
    with pytest.raises(ValueError, match="no joint moves"):
        identify(log, others)


def test_a_straight_friction_line_bends_no_more_often_than_chance():
    chances = np.array([curvature(*found_in(seed)).p[1] for seed in range(60)])
    # at 5 % three of 60 are expected; more than eight have a chance of 1 in 200
    assert np.count_nonzero(chances < 0.05) <= 8


def test_a_stribeck_curve_is_seen_with_its_size():
    """The size is the rms of the curve over the log, less the straight line through it."""
    log, others = found_in(3, stribeck)
    bend = curvature(log, others)
    rate = log.rate[log.moving[:, 1], 1]
    columns = np.column_stack([np.sign(rate), rate])
    extra = stribeck(rate) - line(rate)
    left = extra - columns @ np.linalg.lstsq(columns, extra, rcond=None)[0]
    assert bend.p[1] < 1e-6
    assert bend.size[1] == pytest.approx(np.sqrt(np.mean(left**2)), rel=0.25)
    assert np.isnan(bend.size[0])


def test_the_step_of_an_encoder_is_found_at_constant_speed_and_none_where_nothing_moves():
    t = np.arange(0, 3.0, PERIOD)
    angle = np.column_stack([np.round((1.2345 * t) / STEP) * STEP, 0 * t])
    np.testing.assert_allclose(encoder_step(angle), [STEP, np.inf], rtol=1e-6)


def test_the_idle_run_of_a_slow_arm_needs_its_weight_alone_and_gaps_are_bridged():
    rng = np.random.default_rng(2)
    t = np.arange(0, 60.0, 0.012)
    slow = 0.3 * np.sin(0.25 * t)
    rate = np.gradient(slow, t)
    drive = 12.0 * np.cos(slow) + line(rate) + rng.normal(0, 0.5, len(t))
    keep = np.ones(len(t), dtype=bool)
    keep[700:720] = False
    q = np.column_stack([0 * slow, np.round(slow / STEP) * STEP])
    friction, _ = of_idle_runs(LEVEL, [(t[keep], q[keep], np.column_stack([0 * slow, drive])[keep])])
    assert friction.value[1, 0] == pytest.approx(COULOMB, abs=4 * friction.sd[1, 0])
    assert friction.sd[1, 0] < 0.3
    assert weight_columns(LEVEL, record(slow[:50], drive[:50])).shape[-1] == 8


def idle_run(rng, forth, speed, bump=0.0):
    """Idle run of joint 2 that goes one way at a speed of its own, or back and forth."""
    t = np.arange(0, 20.0, 0.012)
    slow = speed * (0.5 * np.sin(0.6 * t) if forth else t / 20.0)
    rate = np.gradient(slow, t)
    drive = 12.0 * np.cos(slow) + line(rate) + rng.normal(0, 0.5, len(t))
    turns = np.flatnonzero(np.diff(np.sign(rate)))
    after = [bump * np.where(t > t[i], np.exp(-(t - t[i]) / 0.05), 0.0) for i in turns]
    drive -= np.sign(rate) * np.sum(after, axis=0) if after else 0.0
    q = np.column_stack([0 * slow, np.round(slow / STEP) * STEP])
    return t, q, np.column_stack([0 * slow, drive])


def test_runs_at_several_speeds_tell_viscous_friction_though_each_goes_one_way():
    rng = np.random.default_rng(5)
    friction, log = of_idle_runs(
        LEVEL, [idle_run(rng, False, speed) for speed in (0.3141, 0.6172, 0.9213, 0.5234)]
    )
    assert np.isnan(friction.value[1, 0])
    assert friction.value[1, 1] == pytest.approx(VISCOUS, abs=4 * friction.sd[1, 1])
    assert (friction.forward[1], friction.backward[1]) == (True, False)
    assert len(log.rate) == len(friction.residual)


def test_what_a_gear_does_while_it_winds_up_after_a_turn_is_no_friction():
    """Just behind a turn the torque is only on its way to the Coulomb level."""
    rng = np.random.default_rng(6)
    friction, _ = of_idle_runs(LEVEL, [idle_run(rng, True, 1.0, bump=COULOMB) for _ in range(3)])
    assert friction.value[1, 0] == pytest.approx(COULOMB, rel=0.01)
    assert friction.noise[1] < 0.3
    assert friction.forward[1]
    assert friction.backward[1]
