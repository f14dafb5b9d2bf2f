"""The dynamometer of the harder world: mechanics, amplifier, filter and what a cable picks up."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from virtual_cell.units import DEG
from virtual_cell.world.force.amplifier import Amplifier, converted, drawn_amplifier, slow
from virtual_cell.world.force.pickup import HARMONICS, Pickup, picked_up
from virtual_cell.world.force.table import Table, drawn_table, loaded, single_modes

AMPLIFIER = Amplifier(
    np.zeros(3),
    np.full(3, 200.0),
    (0.5, 1.0),
    order=5,
    cutoff=0.3,
    rate=5000.0,
    fast=0.0,
    step=0.5,
    capacity=100.0,
)


def one_mode(hz=1000.0, damping=0.05):
    return Table(
        np.full((3, 2), hz),
        np.ones(3),
        np.full((3, 2), damping),
        plate=4.0,
        work=0.0,
        rocking=np.zeros((3, 3)),
        gains=np.eye(3),
    )


def test_a_single_mode_magnifies_in_closed_form():
    seen = one_mode().response(np.array([0.0, 500.0, 1000.0]))
    assert seen[0] == pytest.approx(np.eye(3))
    assert abs(seen[1, 0, 0]) == pytest.approx(1.0 / math.hypot(1.0 - 0.25, 2.0 * 0.05 * 0.5))
    assert abs(seen[2, 1, 1]) == pytest.approx(1.0 / (2.0 * 0.05))


def test_four_times_the_mass_halves_the_frequency():
    np.testing.assert_allclose(replace(one_mode(), work=12.0).frequency, 500.0)
    assert loaded(one_mode(), 250.0).frequency.min() == pytest.approx(250.0)


def test_at_rest_an_axis_reads_gains_and_crosstalk_and_no_rocking():
    table = drawn_table(np.random.default_rng(4))
    np.testing.assert_allclose(table.response(np.zeros(1))[0].real, table.gains, atol=1e-12)
    off = np.abs(table.gains[~np.eye(3, dtype=bool)])
    assert off.min() >= 0.0049
    assert off.max() <= 0.0301


def test_modes_are_drawn_above_what_is_hidden_on_purpose():
    modes = np.array([drawn_table(np.random.default_rng(s)).frequency[:, 0] for s in range(200)])
    assert modes.min() > 1600.0
    assert modes.max() < 4100.0
    _, _, apart = single_modes(one_mode())
    assert apart == pytest.approx(0.0)


def test_a_table_turned_counter_clockwise_sees_work_x_on_its_x_and_minus_y():
    rows = replace(one_mode(), yaw=30.0 * DEG).turned
    np.testing.assert_allclose(rows @ [1.0, 0.0, 0.0], [np.cos(30 * DEG), -np.sin(30 * DEG), 0.0])
    tilted = replace(one_mode(), yaw=0.1, pitch=0.02, roll=-0.03).turned
    np.testing.assert_allclose(tilted @ tilted.T, np.eye(3), atol=1e-12)


@pytest.mark.parametrize("order", [2, 5, 8])
def test_the_filter_is_a_butterworth_of_its_order(order):
    amplifier = replace(AMPLIFIER, order=order)
    cutoff = amplifier.cutoff * amplifier.rate
    gain = np.abs(amplifier.filter(np.array([0.0, cutoff, 10.0 * cutoff])))
    assert gain[0] == pytest.approx(1.0)
    assert gain[1] == pytest.approx(math.sqrt(0.5))
    assert gain[2] == pytest.approx(10.0**-order, rel=0.01)
    late = np.unwrap(np.angle(amplifier.filter(np.linspace(0.0, cutoff, 100))))
    assert late[-1] == pytest.approx(-order * math.pi / 4.0)  # it lags: each pole by 45 degrees on the mean


def test_a_steady_load_fades_with_the_time_constant_from_where_it_had_faded_to():
    amplifier = replace(AMPLIFIER, constant=np.array([0.5, 2.0, 100.0]))
    load = np.tile([10.0, 10.0, 10.0], (4000, 1))
    fresh = slow(amplifier, load, 1000.0, np.zeros(3), 0.0)
    t = np.arange(1, 4001)[:, None] / 1000.0
    np.testing.assert_allclose(fresh, 10.0 * np.exp(-t / amplifier.constant), rtol=3e-3, atol=1e-3)
    before = slow(amplifier, load, 1000.0, load[0], 1.0)
    np.testing.assert_allclose(before, 10.0 * np.exp(-(t + 1.0) / amplifier.constant), rtol=3e-3, atol=1e-3)


def test_readings_come_in_steps_and_end_at_the_range():
    np.testing.assert_allclose(converted(AMPLIFIER, np.array([0.3, 7.8, 140.0])), [0.5, 8.0, 100.0])
    steps = {drawn_amplifier(5000.0, np.random.default_rng(s)).step for s in range(60)}
    assert min(steps) == pytest.approx(2000.0 / 2**16)
    assert max(steps) == pytest.approx(10000.0 / 2**12)


def test_mains_are_where_they_are_and_noise_rises_below_the_corner():
    hum = np.zeros((3, len(HARMONICS)))
    hum[0, 0] = 3.0
    t = np.arange(200_000) / 2000.0
    noise = picked_up(Pickup(1.0, 8.0, 60.0, hum), t, 2000.0, np.random.default_rng(0))
    hz = np.fft.rfftfreq(len(t), 1.0 / 2000.0)
    power = np.abs(np.fft.rfft(noise, axis=0)) ** 2 * 2.0 / len(t)
    mains = (hz > 59.0) & (hz < 61.0)
    assert math.sqrt(2.0 * power[mains, 0].sum() / len(t)) == pytest.approx(3.0, rel=0.02)
    white, flicker = power[(hz > 300.0) & (hz < 900.0), 1].mean(), power[(hz > 0.9) & (hz < 1.1), 1].mean()
    assert white == pytest.approx(2.0, rel=0.05)
    assert flicker / white == pytest.approx(9.0, rel=0.2)  # 1 + corner/f
