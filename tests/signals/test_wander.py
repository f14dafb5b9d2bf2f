"""The angle of a spindle whose speed wanders, without a tacho: followed, so that it alarms nobody."""

import cuts
import numpy as np
import pytest

from metro.signals.chatter import detect
from metro.signals.orders import spindle_speed
from metro.signals.wander import followed
from virtual_cell.regeneration import march

RATE, SPEED, TEETH, CHATTER_HZ = 2000.0, 20.0, 3, 87.4
TIME = np.arange(int(100 / SPEED * RATE)) / RATE
LAST = TIME[-1]


def drifting(time, amount):
    """Time (n,), s, by which a spindle is ahead whose speed rises by ``amount`` along the record."""
    return amount * (time**2 / time[-1] - time) / 2


def waving(time, amount, times):
    """The same of a spindle whose speed swings by ± ``amount`` so many times."""
    slow = 2 * np.pi * times / time[-1]
    return amount / slow * (1 - np.cos(slow * time))


WANDERS = [
    pytest.param(lambda t, a=amount, f=form: f(t, a), id=f"{name} {100 * amount:g} %")
    for name, form in (
        ("drift", drifting),
        ("one swing", lambda t, a: waving(t, a, 1)),
        ("three swings", lambda t, a: waving(t, a, 3)),
    )
    for amount in (0.002, 0.005, 0.01, 0.02)
]


def wandering(wander, chatter):
    """Record of runout and tooth passing at the angle of the spindle, and of chatter at one frequency."""
    angle = 2 * np.pi * SPEED * (TIME + wander(TIME))
    lines = ((TEETH, 1.0, 0.3), (2 * TEETH, 0.5, 1.0), (1, 0.4, 0.0), (3 * TEETH, 0.25, 2.0))
    signal = sum(a * np.column_stack([np.sin(k * angle + p), np.cos(k * angle)]) for k, a, p in lines)
    mixed = (
        (CHATTER_HZ, chatter),
        (CHATTER_HZ - TEETH * SPEED, chatter / 3),
        (CHATTER_HZ + TEETH * SPEED, chatter / 3),
    )
    for hz, amplitude in mixed:
        signal = signal + amplitude * np.column_stack(
            [np.sin(2 * np.pi * hz * TIME), np.cos(2 * np.pi * hz * TIME)]
        )
    return signal + 0.05 * np.random.default_rng(0).standard_normal(signal.shape), angle


def guessed(time, signal, nominal):
    """Angle from one speed for the whole record."""
    return 2 * np.pi * spindle_speed(time, signal, nominal, 24)[0] * time


@pytest.mark.parametrize("chatter", [0.0, 0.7])
@pytest.mark.parametrize("wander", WANDERS)
def test_the_angle_is_followed_to_hundredths_of_a_radian(wander, chatter):
    signal, angle = wandering(wander, chatter)
    error = followed(TIME, guessed(TIME, signal, SPEED), signal, TEETH) - angle
    assert (error - error.mean()).std() < 0.03


@pytest.mark.parametrize("wander", WANDERS)
def test_wander_alone_is_no_chatter(wander):
    signal, _ = wandering(wander, 0.0)
    one = detect(TIME, followed(TIME, guessed(TIME, signal, SPEED), signal, TEETH), signal, TEETH)
    assert one.probability < 0.05
    assert one.kind == "forced"


@pytest.mark.parametrize("wander", WANDERS)
def test_chatter_is_found_while_the_speed_wanders(wander):
    signal, _ = wandering(wander, 0.7)
    one = detect(TIME, followed(TIME, guessed(TIME, signal, SPEED), signal, TEETH), signal, TEETH)
    assert one.probability > 0.5
    assert one.chatter_hz == pytest.approx(CHATTER_HZ, abs=0.15)


def test_a_steady_speed_is_left_as_it_was_found():
    signal, _ = wandering(lambda time: 0.0 * time, 0.0)
    angle = guessed(TIME, signal, SPEED)
    assert followed(TIME, angle, signal, TEETH) is angle


@pytest.mark.parametrize("amount", [0.005, 0.02])
def test_a_simulated_stable_cut_with_runout_alarms_nobody_while_its_speed_wanders(amount):
    rpm = np.array([1500.0])
    history = march(
        cuts.trials(rpm, 0.4 * cuts.boundary(rpm), edges=0.25, runout=5e-6, scatter=0.02), 80, 120, 1
    )
    time = np.arange(0.4, 2.7, 1 / cuts.RATE)
    for wander in (drifting(time, amount), waving(time, amount, 2)):
        signal = history.at(0, time + wander)
        signal = signal + 2.0 * np.random.default_rng(2).standard_normal(signal.shape)
        angle = followed(time, guessed(time, signal, rpm[0] / 60), signal, cuts.TEETH)
        one = detect(time, angle, signal, cuts.TEETH)
        assert one.probability < 0.05
        assert one.kind == "forced"
