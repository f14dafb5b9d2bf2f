"""What does not repeat with the spindle: tones, closed forms of the energy, noise, and what must not show."""

import numpy as np
import pytest

from metro.signals.asynchronous import over_angle, windows

RATE, SPEED, REVOLUTIONS = 2000.0, 20.0, 150
TIME = np.arange(int(REVOLUTIONS / SPEED * RATE) + 1) / RATE
ANGLE = 2 * np.pi * SPEED * TIME


def noise(sigma=0.01, seed=0, channels=2):
    return sigma * np.random.default_rng(seed).standard_normal((len(TIME), channels))


def tone(order, amplitude=1.0):
    return amplitude * np.column_stack([np.sin(order * ANGLE), np.cos(order * ANGLE)])


def test_the_energy_ratio_is_that_of_the_amplitudes():
    seen = windows(TIME, ANGLE, tone(4) + tone(3.37, 0.5) + noise())
    np.testing.assert_allclose(seen.energy_ratio, 0.25 / 1.25, rtol=0.01)


def test_an_acceleration_counts_like_the_displacement_it_comes_from():
    displacement = tone(4) + tone(8.41, 0.5) + noise(1e-4)
    acceleration = -(4**2) * tone(4) - 8.41**2 * tone(8.41, 0.5) + noise(1e-3)
    of_motion = windows(TIME, ANGLE, displacement).energy_ratio
    of_acceleration = windows(TIME, ANGLE, acceleration, differentiated=2).energy_ratio
    np.testing.assert_allclose(of_acceleration, of_motion, rtol=0.02)


def test_every_order_of_the_spindle_is_taken_out_not_those_of_the_teeth_alone():
    seen = windows(TIME, ANGLE, sum(tone(m, 1 / m) for m in (1, 2, 3, 4, 5, 8, 12, 13)) + noise())
    assert not seen.peaks.any()


def test_what_grows_linearly_or_drifts_is_no_vibration_of_its_own():
    growing = tone(4) * (1 + 2.0 * TIME[:, None] / TIME[-1]) + tone(1, 0.5)
    drift = 5.0 * TIME[:, None] * [1.0, -1.0]
    assert not windows(TIME, ANGLE, growing + drift + noise(0.002)).peaks.any()


def test_noise_alone_makes_a_peak_as_rarely_as_is_said():
    hits = [windows(TIME, ANGLE, noise(seed=seed)).peaks.any(axis=1) for seed in range(60)]
    # 300 windows at 1e-3 each: 0.3 are expected, 4 or more have a probability of 3e-4
    assert np.sum(hits) <= 3


def test_noise_that_rises_towards_low_frequencies_makes_no_peaks_there():
    peaks = 0
    for seed in range(20):
        spectrum = np.fft.rfft(np.random.default_rng(seed).standard_normal((len(TIME), 2)), axis=0)
        spectrum[1:] /= np.sqrt(np.arange(1, len(spectrum)))[:, None]
        peaks += windows(TIME, ANGLE, np.fft.irfft(spectrum, len(TIME), axis=0)).peaks.sum()
    assert peaks <= 4  # in 100 windows


def test_a_line_beside_an_order_counts_as_one_on_it():
    waving = 1 + 0.5 * np.sin(0.011 * ANGLE[:, None])
    assert windows(TIME, ANGLE, tone(4) * waving + noise()).energy_ratio.max() < 1e-3


def test_a_speed_that_wanders_by_a_thousandth_unseen_makes_no_energy_off_the_orders():
    angle = ANGLE + 0.022 * np.sin(2 * np.pi * 0.9 * TIME)
    high = np.column_stack([np.sin(20 * angle), np.cos(20 * angle)])
    assert windows(TIME, ANGLE, tone(4) + high + noise()).energy_ratio.max() < 1e-3


def test_a_tone_is_found_at_its_order_and_one_on_an_order_is_not_looked_at():
    seen = windows(TIME, ANGLE, tone(4) + tone(2.62, 0.05) + noise())
    found = seen.order[np.flatnonzero(seen.peaks.all(axis=0))]
    assert np.abs(found - 2.62).max() < 2 / seen.revolutions
    assert seen.on_order[round(3 * seen.revolutions)]


def test_a_wandering_spindle_leaves_no_rest_where_its_angle_is_known():
    angle = ANGLE + 3.0 * np.sin(2 * np.pi * 0.7 * TIME)
    signal = np.column_stack([np.sin(4 * angle) + 0.4 * np.sin(angle), np.cos(8 * angle)])
    even = over_angle(TIME, angle, signal)
    assert np.ptp(even, axis=0).max() < 2e-3
    assert windows(TIME, angle, signal + noise(1e-3)).energy_ratio.max() < 1e-3


def test_short_records_are_refused_with_what_is_needed():
    short = TIME < 30 / SPEED
    with pytest.raises(ValueError, match="at least 40"):
        windows(TIME[short], ANGLE[short], noise()[short])
