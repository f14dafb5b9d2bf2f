"""Signs and kinds of chatter on made-up signals of which everything is known."""

import numpy as np
import pytest

from metro.signals import chatter_signs as signs
from metro.signals.asynchronous import windows
from metro.signals.chatter import detect

RATE, SPEED, REVOLUTIONS, TEETH = 2000.0, 20.0, 150, 3
TIME = np.arange(int(REVOLUTIONS / SPEED * RATE) + 1) / RATE
ANGLE = 2 * np.pi * SPEED * TIME
RNG = np.random.default_rng


def tone(order, amplitude=1.0):
    return np.column_stack([np.sin(order * ANGLE), np.cos(order * ANGLE)]) * np.reshape(amplitude, (-1, 1))


def noisy(signal, seed=0):
    return signal + 0.02 * RNG(seed).standard_normal(signal.shape)


def seen(signal):
    return windows(TIME, ANGLE, noisy(signal + tone(TEETH)))


@pytest.mark.parametrize("order", [2.62, 4.3711, 7.204, 0.4])
def test_the_line_is_found_to_a_small_part_of_a_bin(order):
    found = signs.line(seen(tone(order)))
    assert np.abs(found - order).max() < signs.FINEST / 50


def test_side_bands_are_those_a_tooth_passing_away():
    alone, mirrored = tone(4.37), tone(4.37) + tone(7.37, 0.3) + tone(1.37, 0.3)
    elsewhere = tone(4.37) + tone(6.37, 0.3) + tone(2.37, 0.3)
    told = [signs.side_bands(s := seen(x), signs.line(s), TEETH).all() for x in (alone, mirrored, elsewhere)]
    assert told == [False, True, False]


def test_growth_is_a_rise_all_along():
    rising, falling = np.exp(0.4 * TIME), np.exp(-0.4 * TIME)
    waving = 1.0 + 0.9 * np.sin(2 * np.pi * TIME / 3.0)
    assert [signs.growing(seen(tone(4.37, a))) for a in (rising, falling, waving)] == [True, False, False]


def test_one_amplitude_is_a_closed_curve_and_a_mode_shaken_by_noise_is_not():
    steady, rising = tone(4.37), tone(4.37, np.exp(0.4 * TIME))
    omega, zeta = 4.37 * 2 * np.pi * SPEED, 0.02
    pole = np.exp((-zeta + 1j) * omega / RATE)
    shaken = np.zeros(len(TIME), dtype=complex)
    for i, push in enumerate(RNG(3).standard_normal(len(TIME) - 1)):
        shaken[i + 1] = pole * shaken[i] + push
    shaken = np.column_stack([shaken.real, shaken.imag]) / shaken.std()
    scatter = [signs.amplitude_scatter(seen(x), 4.37) for x in (steady, rising, shaken)]
    assert scatter[0] < 0.05
    assert scatter[1] < 0.1
    assert scatter[2] > signs.RING


def test_a_line_of_one_frequency_is_narrow_and_a_mode_shaken_by_noise_is_not():
    shaken = np.random.default_rng(5).standard_normal(len(TIME))
    pole = np.exp((-0.02 + 1j) * 4.37 * 2 * np.pi * SPEED / RATE)
    ring = np.zeros(len(TIME), dtype=complex)
    for i in range(1, len(TIME)):
        ring[i] = pole * ring[i - 1] + shaken[i]
    ring = np.column_stack([ring.real, ring.imag]) / ring.std()
    told = [signs.kept_frequency(s := seen(x), signs.line(s)) for x in (tone(4.37), ring, 0.0 * ring)]
    assert told[0] == pytest.approx((4.37 * SPEED, 1.0), abs=0.005)
    assert told[1][1] < 0.6
    assert told[2][1] < 0.2


@pytest.mark.parametrize(("order", "kind"), [(4.5, "flip"), (4.37, "hopf"), (1.5, "flip"), (3.5, "hopf")])
def test_half_the_tooth_passing_is_a_flip(order, kind):
    assert signs.kind_of(order, TEETH, 0.02) == kind


def test_a_flip_of_three_teeth_is_found_in_a_record():
    one = detect(TIME, ANGLE, noisy(tone(TEETH) + tone(1.5) + tone(4.5, 0.4) + tone(7.5, 0.2)), TEETH)
    assert one.kind == "flip"
    assert one.probability > 0.9
    assert one.chatter_hz == pytest.approx(1.5 * SPEED, abs=4 * one.chatter_sd_hz)


def test_runout_and_ringing_are_not_locked_chatter_but_a_second_order_that_mixes_or_grows_may_be():
    runout = tone(1, 2.0) + tone(2, 0.4) + tone(4, 0.5)
    assert not signs.locked(seen(runout), TEETH)
    assert not signs.locked(seen(tone(2, 3.0)), TEETH)
    assert signs.locked(seen(tone(2, 3.0) + tone(4, 0.6) + tone(5, 0.4)), TEETH)
    assert signs.locked(seen(tone(1, np.linspace(0.1, 4.0, len(TIME)))), TEETH)


MODES, DAMPING = np.array([18.0, 400.0]), np.array([0.03, 0.03])


def test_one_frequency_at_all_speeds_in_a_mode_of_the_robot_is_its_own():
    rpm, chatter = np.array([3000.0, 4000.0, 6000.0, 5000.0]), np.array([18.05, 17.95, 18.1, np.nan])
    np.testing.assert_array_equal(signs.at_a_robot_mode(chatter, rpm, MODES, DAMPING), [1, 1, 1, 0])


def test_a_frequency_that_follows_the_speed_or_is_high_or_seen_at_one_speed_is_not_the_robots():
    rpm = np.array([3000.0, 4000.0, 6000.0])
    follows, high, steady = np.array([17.6, 18.0, 18.5]), np.full(3, 400.0), np.full(3, 18.0)
    assert not signs.at_a_robot_mode(follows, rpm, MODES, DAMPING).any()
    assert not signs.at_a_robot_mode(high, rpm, MODES, DAMPING).any()
    assert not signs.at_a_robot_mode(steady, np.full(3, 3000.0), MODES, DAMPING).any()
