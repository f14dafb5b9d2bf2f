"""The speed in a force record against the declared one."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from metro.slips import force as force_room
from metro.slips.speed import period, repeats_per_revolution, turns_as_declared

RATE, RPM, TEETH = 10000.0, 6000.0, 3


def record(rpm=RPM, runout=0.0, noise=0.05, seconds=0.6, ring_hz=None):
    """Pulses of three teeth, one of them weaker by ``runout``; or the ringing of a resonance with each."""
    rng = np.random.default_rng(2)
    t = np.arange(0.0, seconds, 1.0 / RATE)
    turn = t * rpm / 60.0
    tooth = np.floor(turn * TEETH) % TEETH
    phase = (turn * TEETH) % 1.0
    force = np.where(phase < 0.5, np.sin(2 * np.pi * phase), 0.0) * (1.0 - runout * (tooth == 0))
    if ring_hz:
        since = phase / (TEETH * rpm / 60.0)
        force = force + np.exp(-since * 300.0) * np.sin(2 * np.pi * ring_hz * since)
    channels = np.column_stack([force, 0.7 * np.roll(force, 9), 0.3 * force])
    return channels + noise * rng.normal(size=channels.shape)


def passes(signal, declared):
    found = period(signal, RATE, 60.0 / declared)
    return None if found is None else repeats_per_revolution(found, 60.0 / declared, TEETH)


@pytest.mark.parametrize("runout", [0.0, 0.6])
@pytest.mark.parametrize("declared", [6000.0, 5970.0, 6030.0])
def test_a_record_of_the_declared_speed_repeats_with_its_revolution(declared, runout):
    assert passes(record(runout=runout), declared) is None


@pytest.mark.parametrize("declared", [6600.0, 5400.0, 12000.0 / 7.0])
def test_a_speed_that_is_off_is_measured(declared):
    found = passes(record(), declared)
    assert found * declared / TEETH == pytest.approx(RPM, rel=0.01)


def test_sixty_for_six_thousand_repeats_more_often_than_a_tool_has_teeth():
    assert passes(record(seconds=1.2), 60.0) == pytest.approx(300.0, rel=0.01)


@pytest.mark.parametrize("runout", [0.0, 0.6])
def test_a_tenth_of_the_speed_repeats_more_often_than_so_many_teeth_do(runout):
    found = passes(record(runout=runout, seconds=1.2), 600.0)
    assert found == pytest.approx(10.0 if runout else 30.0, rel=0.01)


def test_twice_as_many_teeth_as_declared_are_a_matter_of_counting_and_not_of_speed():
    assert passes(record(), RPM / 2.0) is None


def test_a_resonance_that_rings_between_the_teeth_is_no_speed():
    assert passes(record(ring_hz=2200.0), RPM) is None


def test_noise_has_no_period():
    noise = np.random.default_rng(1).normal(size=(4000, 3))
    assert period(noise, RATE, 0.01) is None
    assert period(np.zeros((100, 3)), RATE, 0.01) is None


def with_chatter(order, seconds=2.0):
    """Chatter on an order of 6000 rpm, twenty times as strong as the runout that shows the revolution."""
    rng = np.random.default_rng(3)
    turn = np.arange(0.0, seconds, 1.0 / RATE) * RPM / 60.0
    wave = 20.0 * np.sin(2 * np.pi * order * turn) + np.sin(2 * np.pi * turn) + 2.0
    return np.column_stack([wave, 0.6 * np.roll(wave, 7)]) + 0.3 * rng.normal(size=(len(wave), 2))


@pytest.mark.parametrize("order", [0.727, 2.744, 4.35])
def test_chatter_that_drowns_the_teeth_is_no_other_speed(order):
    signal = with_chatter(order)
    found = period(signal, RATE, 60.0 / RPM)
    assert repeats_per_revolution(found, 60.0 / RPM, TEETH) == pytest.approx(order, rel=0.01)
    assert turns_as_declared(signal, RATE, 60.0 / RPM, found, TEETH)


@pytest.mark.parametrize("runout", [0.0, 0.6])
@pytest.mark.parametrize("declared", [60.0, 5400.0, 6150.0, 6600.0, 12000.0 / 7.0])
def test_a_speed_that_is_off_leaves_no_line_at_the_declared_orders(declared, runout):
    signal = record(runout=runout, seconds=2.0)
    found = period(signal, RATE, 60.0 / declared)
    assert not turns_as_declared(signal, RATE, 60.0 / declared, found, TEETH)


@pytest.mark.parametrize(("stable", "slips"), [("yes", 1), ("undecided", 1), (None, 1), ("no", 0)])
def test_a_cut_that_is_declared_to_chatter_says_nothing_of_the_speed(monkeypatch, stable, slips):
    turn = np.arange(0.0, 2.0, 1.0 / RATE) * RPM / 60.0
    wave = 20.0 * np.sin(2 * np.pi * 0.3343 * turn)  # no line of the teeth is left
    signal = np.column_stack([wave, 0.6 * np.roll(wave, 7)])
    stretch = SimpleNamespace(tacho=np.full(len(wave), np.nan), signal=signal)
    record = SimpleNamespace(samples=len(wave), rate=RATE, stretches=lambda _: iter([stretch]))
    monkeypatch.setattr(force_room, "LongRecord", lambda *_: record)
    runs = pd.DataFrame({"spindle_rpm": [RPM], "orbit_rpm": [np.nan], "stable": [stable]}, index=["t1"])
    batch = SimpleNamespace(runs=runs, manifest={"tool": {"teeth": 3}}, with_files=lambda _: ["t1"])
    assert len(force_room.speed_slips(batch, None)) == slips
