"""Air, entry, steady cut and exit of synthetic force records."""

import numpy as np
import pytest

from metro.signals.steady import segments, turns, zero_line

TURN = 100  # samples per revolution


def record(air=0, entry=0, steady=0, leaving=0, *, after=0, zero=3.0):
    """Force of a cut by its phases, in revolutions."""
    level = np.concatenate(
        [
            np.zeros(air),
            np.linspace(0, 1, entry + 2)[1:-1],
            np.ones(steady),
            np.linspace(1, 0, leaving + 2)[1:-1],
            np.zeros(after),
        ]
    )
    size = np.repeat(level, TURN)
    rng = np.random.default_rng(1)
    wave = 100.0 * size * (1 + 0.5 * np.cos(6 * np.pi * np.arange(len(size)) / TURN))
    return np.column_stack([wave, -0.5 * wave]) + rng.normal(size=(len(size), 2)) + zero


def test_air_entry_steady_exit_are_told_apart():
    signal = record(20, 10, 60, 10, after=20)
    found = segments(turns([signal], TURN), settling=10 * TURN)
    assert 30 * TURN <= found.steady.start <= 36 * TURN
    assert 84 * TURN <= found.steady.stop <= 90 * TURN
    assert found.quiet[:19].all()
    assert found.quiet[-19:].all()
    assert not found.quiet[20:100].any()
    assert found.turns.mean[found.quiet].mean(axis=0) == pytest.approx([3.0, 3.0], abs=0.1)


def test_a_record_of_steady_cutting_alone_is_kept_whole():
    signal = record(steady=40)
    found = segments(turns([signal], TURN), settling=10 * TURN)
    assert (found.steady.start, found.steady.stop) == (0, len(signal))
    assert not found.quiet.any()


def test_a_record_that_begins_in_the_cut_is_settled_at_its_end_only():
    signal = record(steady=40, leaving=5, after=20)
    found = segments(turns([signal], TURN), settling=5 * TURN)
    assert found.steady.start == 0
    assert 34 * TURN <= found.steady.stop <= 40 * TURN


def test_a_large_zero_offset_is_not_a_cut():
    found = segments(turns([record(30, 2, 50, 2, after=30, zero=25.0)], TURN), settling=2 * TURN)
    assert found.steady.start >= 32 * TURN
    assert found.steady.stop <= 82 * TURN


def test_a_cut_that_is_over_before_full_engagement_is_refused():
    with pytest.raises(ValueError, match="before the tool is fully engaged"):
        segments(turns([record(20, 5, 10, 5, after=20)], TURN), settling=8 * TURN)


def test_the_longest_of_two_cuts_is_taken():
    signal = np.concatenate([record(10, 0, 15, 0, after=10), record(10, 0, 50, 0, after=10)])
    found = segments(turns([signal], TURN), settling=0)
    assert found.steady.start == pytest.approx(45 * TURN, abs=TURN)
    assert found.steady.stop == pytest.approx(95 * TURN, abs=TURN)


def test_a_record_shorter_than_a_revolution_has_none():
    """A spindle speed in the table that is far too low: the record is refused for that reason."""
    found = turns([np.ones((50, 3))], 60_000.0)
    assert (found.samples, found.mean.shape, found.square.shape) == (50, (0, 3), (0, 3))
    with pytest.raises(ValueError, match="50 samples, fewer than the 60000 of one revolution"):
        segments(found, 0)


def test_a_dead_channel_is_no_cut():
    with pytest.raises(ValueError, match="nought in the whole record"):
        segments(turns([np.zeros((20 * TURN, 3))], TURN), settling=0)


@pytest.mark.parametrize("zero", [0.0, 20.0, 60.0, -90.0])
def test_air_is_found_whatever_the_zero_of_the_amplifier(zero):
    """A charge amplifier that was reset long before the record begins far from nought."""
    signal = record(20, 10, 60, zero=zero)
    found = segments(turns([signal], TURN), settling=10 * TURN)
    assert found.quiet[:19].all()
    assert not found.quiet[21:].any()
    assert found.turns.mean[found.quiet].mean(axis=0) == pytest.approx([zero, zero], abs=0.1)
    assert 30 * TURN <= found.steady.start <= 36 * TURN


@pytest.mark.parametrize("size", [0.15, 0.3, 1.0])
def test_air_is_found_on_both_sides_of_a_small_cut_while_the_zero_drifts(size):
    """The charge drifts on from 12 to 24 while a force is cut that is hardly larger."""
    signal = record(20, 4, 60, 4, after=20, zero=0.0) * size
    signal += np.linspace(12.0, 24.0, len(signal))[:, None]
    found = segments(turns([signal], TURN), settling=4 * TURN)
    assert found.quiet[:19].all()
    assert found.quiet[-19:].all()
    assert not found.quiet[21:87].any()
    start, drift = zero_line(found.turns.mean, found.quiet, 54.0)
    assert start == pytest.approx([12.0, 12.0], abs=0.1)
    assert drift * 108 == pytest.approx([12.0, 12.0], abs=0.1)


def test_noise_is_no_force_beside_a_zero_that_is_off():
    """In each revolution it has an eighth of the force: more than what counts as air without its noise."""
    rng = np.random.default_rng(2)
    signal = record(20, 2, 60, zero=40.0) + 10.0 * rng.normal(size=(82 * TURN, 2))
    found = segments(turns([signal], TURN), settling=2 * TURN)
    assert found.quiet[:19].all()
    assert not found.quiet[22:].any()


def test_a_cut_before_chatter_sets_in_is_no_air():
    """It swings far less than what follows, about nearly the same mean force."""
    calm, loud = record(steady=20), record(steady=40)
    swing = np.sin(0.7 * np.arange(len(loud)))[:, None] * 600.0
    found = segments(turns([np.concatenate([calm, loud + swing + 20.0])], TURN), settling=0)
    assert not found.quiet.any()


def test_a_cut_on_a_helix_before_chatter_sets_in_is_no_air():
    """Its mean turns with the orbit, so that it differs from that of the chatter."""
    count = 60 * TURN
    angle = np.linspace(0.0, 1.5 * np.pi, count)
    mean = 80.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    swing = np.where(np.arange(count) < 20 * TURN, 6.0, 120.0)[:, None]
    signal = mean + swing * np.sin(0.7 * np.arange(count))[:, None]
    assert not segments(turns([signal], TURN), settling=0).quiet.any()
