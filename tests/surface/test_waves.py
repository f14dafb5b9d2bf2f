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


def test_a_signal_far_above_its_noise_passes_and_noise_alone_hardly_does():
    rng = np.random.default_rng(3)
    noise, signal = rng.normal(size=400), rng.normal(size=400)
    assert signal_share(30.0 * signal + noise, 1.0, 30.0 * signal).min() > 0.98
    assert signal_share(noise, 1.0, signal).mean() < 0.4
    np.testing.assert_array_equal(signal_share(noise, 0.0, signal), 1.0)


def test_there_is_no_more_signal_than_the_other_reading_has_waves():
    rng = np.random.default_rng(3)
    assert signal_share(rng.normal(size=400), 1.0, 0.1 * rng.normal(size=400)).max() < 0.05


@pytest.mark.parametrize("size", [0.0, 0.5, 1.0, 3.0])
def test_the_signal_lies_within_the_stated_error_of_its_share(size):
    """Mean square of (signal − w × reading) is w N at most, for signals of any size."""
    rng = np.random.default_rng(4)
    signal, noise = size * rng.normal(size=(200, 300)), rng.normal(size=(200, 300))
    share = np.array([signal_share(a + b, 1.0, a) for a, b in zip(signal, noise, strict=True)])
    assert np.mean((signal - share * (signal + noise)) ** 2) <= 1.05 * np.mean(share)
