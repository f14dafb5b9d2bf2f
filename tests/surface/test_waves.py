"""Waviness parameters, the basis of waves, and Wiener's share, against closed forms."""

import numpy as np
import pytest
from scipy.fft import dct

from metro.surface.waves import signal_share, wave_basis, waviness, white_noise


def test_parameters_of_a_sine_are_those_of_the_closed_form():
    x = np.arange(4000) / 4000
    found = waviness(7.0 + 3.0 * np.sin(2 * np.pi * 8 * x))
    assert found.wa == pytest.approx(3.0 * 2 / np.pi, rel=1e-4)
    assert found.wq == pytest.approx(3.0 / np.sqrt(2), rel=1e-4)
    assert found.wt == pytest.approx(6.0, rel=1e-4)


def test_the_waves_are_those_of_the_cosine_transform_within_the_band():
    profile = np.random.default_rng(1).normal(size=300)
    waves, length = wave_basis(300, 0.2, 0.8, 8.0)
    every = dct(profile, norm="ortho")
    order = np.round(2 * 300 * 0.2 / length).astype(int)
    np.testing.assert_allclose(waves @ profile, every[order], atol=1e-12)
    assert order.min() == 15  # 120 mm / 15 = 8 mm
    assert order.max() == 150
    np.testing.assert_allclose(waves @ waves.T, np.eye(len(waves)), atol=1e-12)


def test_noise_is_read_beside_a_smooth_signal():
    rng = np.random.default_rng(2)
    smooth = 20.0 * np.sin(2 * np.pi * np.arange(20000) / 60)
    assert white_noise(smooth + 0.5 * rng.normal(size=20000)) == pytest.approx(0.25, rel=0.03)


def share_of_one(reading, noise, whole):
    share, missed, passed = signal_share(reading[:, None], np.array([noise]), whole)
    np.testing.assert_allclose(passed, share[:, 0] ** 2 * noise)
    return share[:, 0], missed


def test_a_signal_far_above_its_noise_passes_and_noise_alone_does_not():
    rng = np.random.default_rng(3)
    noise, signal = rng.normal(size=400), rng.normal(size=400)
    assert share_of_one(30.0 * signal + noise, 1.0, 30.0 * signal)[0].min() > 0.98
    assert share_of_one(noise, 1.0, signal)[0].mean() < 0.05
    share, missed = share_of_one(noise, 0.0, signal)
    np.testing.assert_array_equal(share, 1.0)
    np.testing.assert_array_equal(missed, 0.0)


def test_there_is_no_more_signal_than_the_whole_has_beyond_its_noise():
    rng = np.random.default_rng(3)
    reading, whole = 3.0 * rng.normal(size=400), 0.1 * rng.normal(size=400)
    share, missed = share_of_one(reading, 1.0, whole)
    assert share.max() < 0.05
    assert missed.max() < 0.05
    _, missed, _ = signal_share(rng.normal(size=(400, 6)), np.ones(6), whole, whole_noise=0.01)
    assert np.mean(missed) < 0.01  # of six readings together, each of which may miss 0.4 and more


def test_a_reading_passes_that_is_clear_beside_one_that_is_noisy():
    """Their sum would drown: of a line of rms 1 in noise of variance 25, nothing passes."""
    rng = np.random.default_rng(5)
    line = np.where((np.arange(400) >= 190) & (np.arange(400) < 193), 8.0, 0.0)
    readings = np.column_stack([5.0 * rng.normal(size=400), line + 0.1 * rng.normal(size=400)])
    share, *_ = signal_share(readings, np.array([25.0, 0.01]), line)
    assert share[190:193, 1].min() > 0.99
    assert share[:, 0].max() < 0.6
    assert np.abs((share * readings).sum(axis=1) - line)[190:193].max() < 8.0


def test_a_regression_on_what_passes_is_hardly_pulled_to_zero_by_runs_without_a_signal():
    """Slope of the whole on w × reading where one run in ten has a signal."""
    rng = np.random.default_rng(6)
    over, under = 0.0, 0.0
    for run in range(100):
        signal = (1.5 if run % 10 == 0 else 0.0) * rng.normal(size=300)
        passed, whole = signal + rng.normal(size=300), signal + rng.normal(size=300)
        share, _ = share_of_one(passed, 1.0, whole)
        over, under = over + whole @ (share * passed), under + np.sum((share * passed) ** 2)
    assert over / under == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("size", [0.0, 0.5, 1.0, 3.0])
def test_the_signal_lies_within_the_stated_error_of_its_share(size):
    rng = np.random.default_rng(4)
    signal, noise = size * rng.normal(size=(200, 300)), rng.normal(size=(200, 300))
    told = [share_of_one(a + b, 1.0, a) for a, b in zip(signal, noise, strict=True)]
    share, missed = (np.array(part) for part in zip(*told, strict=True))
    assert np.mean((signal - share * (signal + noise)) ** 2) <= 1.05 * np.mean(missed + share**2)
    assert np.mean(((1.0 - share) * signal) ** 2) <= 1.05 * np.mean(missed)
