"""Order tracking against signals made from known orders and speeds."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.signals.orders import (
    advance,
    aligned,
    highest_order,
    order_averages,
    order_matrix,
    spindle_speed,
    to_orders,
)

seeds = st.integers(0, 10_000)


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 12), seeds)
def test_a_waveform_goes_to_orders_and_back(highest, seed):
    value = np.random.default_rng(seed).normal(size=(2 * highest + 1, 3))
    angle = 2 * math.pi * np.arange(64) / 64
    assert to_orders(order_matrix(angle, highest) @ value, highest) == pytest.approx(value, abs=1e-12)


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 12), seeds)
def test_squares_of_the_coefficients_sum_to_the_mean_square(highest, seed):
    value = np.random.default_rng(seed).normal(size=2 * highest + 1)
    wave = order_matrix(2 * math.pi * np.arange(100) / 100, highest) @ value
    assert np.mean(wave**2) == pytest.approx(np.sum(value**2))


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 12), st.floats(-10.0, 10.0), seeds)
def test_advancing_the_coefficients_turns_the_waveform(highest, turn, seed):
    value = np.random.default_rng(seed).normal(size=(2 * highest + 1, 2))
    angle = np.linspace(0.0, 6.0, 17)
    turned = order_matrix(angle, highest) @ advance(value, turn)
    assert turned == pytest.approx(order_matrix(angle + turn, highest) @ value, abs=1e-10)


def test_highest_order_keeps_six_tooth_passings_below_the_limit_of_sampling():
    assert highest_order(1e5, 100.0, 2) == 24
    assert highest_order(1e5, 100.0, 6) == 36
    assert highest_order(1e5, 100.0, 12) == 48
    assert highest_order(2000.0, 100.0, 4) == 6


def record(speed, orders, rng, *, seconds=1.5, rate=5000.0, noise=1.0):
    """Two channels with the given orders of a speed in revolutions per second."""
    time = 3.0 + np.arange(int(seconds * rate)) / rate
    angle = 2 * math.pi * speed * time
    signal = sum(
        np.outer(np.cos(order * angle + rng.uniform(0, 6.28)), [4.0, 2.0]) / (1 + 0.1 * order)
        for order in orders
    )
    return time, 20.0 + signal + noise * rng.normal(size=(len(time), 2))


@pytest.mark.parametrize("orders", [range(1, 13), (3, 6, 9, 12)])
@pytest.mark.parametrize("off", [-0.005, 0.0013, 0.005])
def test_the_true_speed_is_found_from_the_force_alone(orders, off):
    nominal, rng = 50.0, np.random.default_rng(4)
    time, signal = record(nominal * (1 + off), orders, rng)
    speed, _ = spindle_speed(time, signal, nominal, 18)
    assert speed == pytest.approx(nominal * (1 + off), rel=1e-5)


def test_the_standard_deviation_of_the_speed_covers_its_error():
    z = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        time, signal = record(50.1, (3, 6), rng, noise=6.0)
        speed, sd = spindle_speed(time, signal, 50.0, 9)
        z.append((speed - 50.1) / sd)
    assert np.mean(np.abs(z) < 2.0) >= 0.85
    assert np.sqrt(np.mean(np.square(z))) > 0.2  # and is not needlessly wide


def test_a_short_record_has_a_speed_without_an_error():
    time, signal = record(50.0, (1, 2), np.random.default_rng(1), seconds=0.3)
    assert math.isnan(spindle_speed(time, signal, 50.0, 4)[1])


def test_a_record_of_less_than_eight_revolutions_is_taken_to_have_the_nominal_speed():
    time, signal = record(20.1, (2, 4), np.random.default_rng(1), seconds=0.3)
    assert spindle_speed(time, signal, 20.0, 24)[0] == 20.0


def test_order_averages_return_the_injected_coefficients_within_their_errors():
    value = np.random.default_rng(2).normal(size=(9, 2))
    z = []
    for seed in range(25):
        rng = np.random.default_rng(seed)
        time = np.arange(10000) / 5000.0
        angle = 2 * math.pi * 50.0 * time + 0.3
        signal = order_matrix(angle, 4) @ value + 3.0 * rng.normal(size=(10000, 2))
        (average,) = order_averages(time, angle, signal, 4, 1)
        z.append((average.value - value.T) / np.sqrt(average.variance))
        assert np.median(average.variance) == pytest.approx(9.0 / 10000, rel=0.4)
    assert np.mean(np.abs(z) < 1.96) == pytest.approx(0.95, abs=0.03)
    assert np.sqrt(np.mean(np.square(z))) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(
    "drift",
    [lambda time: 5.0 + 2.0 * np.round(time - 0.5), lambda time: 4.0 + 2.0 * time],
    ids=["steps", "ramp"],
)
def test_time_blocks_see_a_drift_that_is_not_counted_as_noise(drift):
    rng = np.random.default_rng(3)
    time = np.arange(20000) / 5000.0
    angle = 2 * math.pi * 50.0 * time
    signal = drift(time)[:, None] + 0.5 * rng.normal(size=(20000, 1))
    averages = order_averages(time, angle, signal, 3, 4)
    assert [average.middle for average in averages] == pytest.approx([0.5, 1.5, 2.5, 3.5], abs=1e-3)
    assert [average.value[0, 0] for average in averages] == pytest.approx([5.0, 7.0, 9.0, 11.0], abs=0.05)
    assert averages[0].variance[0, 0] < 4 * 0.25 / 5000


def test_one_wild_order_is_drawn_towards_its_neighbours_but_not_lost():
    rng = np.random.default_rng(6)
    time = np.arange(10000) / 5000.0
    angle = 2 * math.pi * 50.0 * time
    loud = np.cos(3 * angle) * np.repeat(rng.normal(size=25), 400)  # changes from segment to segment
    (average,) = order_averages(time, angle, (loud + 0.1 * rng.normal(size=10000))[:, None], 12, 1)
    own, others = average.variance[0, 5], np.median(average.variance)
    true = np.var(np.repeat(rng.normal(size=25), 400)) * 0.5 / 25
    assert others < 0.1 * own
    assert own == pytest.approx(true, rel=1.5)


@pytest.mark.parametrize(("revolutions", "low", "high"), [(1.5, 0.8, 1.2), (6, 0.85, 1.2), (40, 0.9, 1.15)])
def test_the_error_of_a_short_record_is_as_large_as_repeats_of_it_scatter(revolutions, low, high):
    """White noise; a record of one revolution has but its own samples to say so, six make three segments."""
    rng, speed = np.random.default_rng(4), 63.3
    time = np.arange(int(5000 * revolutions / speed)) / 5000
    angle = 2 * np.pi * speed * time
    shape = np.stack([10 * np.cos(3 * angle + 0.3), 5 + 0 * angle, np.cos(6 * angle)], axis=1)
    found = [
        order_averages(time, angle, shape + 2.0 * rng.standard_normal(shape.shape), 20, 1)[0]
        for _ in range(150)
    ]
    scatter = np.var([one.value for one in found], axis=0)
    assert np.all(found[0].variance > 0.0)
    assert low < np.mean([one.variance for one in found]) / scatter.mean() < high


def test_what_differs_from_one_revolution_to_the_next_is_an_error_of_a_record_of_six_of_them():
    """Three segments have 0.51 degrees of freedom beside 6 of neighbouring orders: a wild one keeps 8 %."""
    rng = np.random.default_rng(5)
    time = np.arange(600) / 5000
    angle, found = 2 * np.pi * 50.0 * time, []
    for _ in range(150):
        uneven = np.repeat(rng.normal(size=6), 100) * np.cos(3 * angle)
        signal = 5.0 * np.cos(3 * angle) + uneven + 0.05 * rng.standard_normal(600)
        found.append(order_averages(time, angle, signal[:, None], 20, 1)[0])
    scatter = np.var([one.value[0, 5] for one in found])
    assert np.mean([one.variance[0, 5] for one in found]) > 0.07 * scatter


@pytest.mark.parametrize("turn", [0.0, 0.4, 2.9, 5.5])
def test_a_waveform_is_turned_back_to_where_it_was(turn):
    rng = np.random.default_rng(5)
    value = rng.normal(size=(3, 25)) / (1.0 + np.arange(25) // 2)
    turned = advance(value.T, turn).T + 1e-4 * rng.normal(size=value.shape)
    np.testing.assert_allclose(aligned(turned, value), value, atol=1e-3)
