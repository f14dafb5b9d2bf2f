"""The spindle of the harder world: even without its faults, and as uneven as it is drawn with them."""

from __future__ import annotations

import numpy as np
import pytest

from virtual_cell.world.force.spindle import Spindle, drawn_spindle, turning

OMEGA = 500.0  # rad/s


def turned(spindle, until=1.0, contact=(10.0, 20.0), seed=0):
    return turning(spindle, OMEGA, until, contact, rng=np.random.default_rng(seed))


def speed(spindle, **settings):
    made = turned(spindle, **settings)
    return made.t[1:], np.diff(made.angle) / np.diff(made.t) / OMEGA - 1.0


def test_a_perfect_spindle_turns_evenly():
    _, off = speed(Spindle())
    assert np.abs(off).max() < 1e-6


def test_times_are_found_from_angles():
    made = turned(Spindle(off=0.003, wander=0.003, wander_s=0.2, ripple=0.0004, poles=12))
    t = np.linspace(0.0, 1.0, 777)
    np.testing.assert_allclose(made.when(made.at(t)), t, atol=1e-12)


def test_wander_has_its_deviation_and_forgets_in_its_time():
    wander = Spindle(wander=0.002, wander_s=0.5)
    ends = []
    for seed in range(200):
        t, off = speed(wander, seed=seed)
        ends.append(np.interp([0.0, 0.5], t, off))
    first, later = np.array(ends).T
    assert np.std(first) == pytest.approx(0.002, rel=0.15)
    assert np.std(later) == pytest.approx(0.002, rel=0.15)
    assert np.mean(first * later) / 0.002**2 == pytest.approx(np.exp(-1.0), abs=0.2)


def test_the_speed_droops_at_entry_and_comes_back():
    t, off = speed(Spindle(droop=0.004, recovery_s=0.1), contact=(0.2, 5.0))
    assert np.abs(off[t < 0.19]).max() < 1e-6
    assert off.min() == pytest.approx(-0.004, rel=0.35)
    assert 0.2 < t[np.argmin(off)] < 0.26
    assert abs(off[t > 0.9]).max() < 0.004 * np.exp(-6.5)


def test_the_ripple_comes_as_often_as_there_are_poles():
    t, off = speed(Spindle(ripple=0.0004, poles=6))
    hz = np.fft.rfftfreq(len(t), t[1] - t[0])
    spectrum = np.abs(np.fft.rfft(off)) * 2.0 / len(t)
    assert hz[np.argmax(spectrum)] == pytest.approx(6.0 * OMEGA / (2.0 * np.pi), abs=2.0)
    assert off.max() == pytest.approx(0.0004, rel=0.05)


def test_what_is_drawn_covers_the_published_range():
    drawn = [drawn_spindle(np.random.default_rng(seed)) for seed in range(300)]
    for name, low, high in (
        ("wander", 0.0001, 0.003),
        ("wander_s", 0.2, 5.0),
        ("droop", 0.0005, 0.005),
    ):
        values = np.array([getattr(one, name) for one in drawn])
        assert low * 0.99 <= values.min() < 1.3 * low
        assert high / 1.3 < values.max() <= high * 1.01
        assert np.median(values) == pytest.approx(np.sqrt(low * high), rel=0.35)  # log-uniform
    assert max(abs(one.off) for one in drawn) <= 0.005
