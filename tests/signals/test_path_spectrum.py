"""Lines in the spectra of simulated path errors, and none in noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from metro.signals.path_spectrum import even_samples, spectrum

PERIOD = 0.012


def coloured(rng, count, sd, persistence=0.8):
    white = rng.normal(0, sd, count + 200)
    return lfilter([np.sqrt(1 - persistence**2)], [1, -persistence], white)[200:]


def test_a_line_at_0_6_hz_is_found_in_an_encoders_path_error():
    """As [F] fig. 10b: 45 s of a face pass, a line of 8 µm under coloured noise of 10 µm and a slow drift."""
    inside_f, inside_a = [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        t = PERIOD * np.arange(3750)
        phase = rng.uniform(0, 2 * np.pi)
        error = 8e-6 * np.sin(2 * np.pi * 0.6 * t + phase) + coloured(rng, len(t), 10e-6) + 1e-6 * t
        found = spectrum(error, PERIOD)
        line = found.lines[0]
        assert line.probability < 0.01
        assert line.frequency == pytest.approx(0.6, abs=0.01)
        inside_f.append(abs(line.frequency - 0.6) < 1.96 * line.frequency_sd)
        inside_a.append(abs(line.amplitude - 8e-6) < 1.96 * line.amplitude_sd)
    assert 0.87 <= np.mean(inside_f) <= 1.0
    assert 0.87 <= np.mean(inside_a) <= 1.0


@pytest.mark.parametrize("persistence", [0.0, 0.8])
def test_noise_has_no_lines(persistence):
    found = [
        len(spectrum(coloured(np.random.default_rng(seed), 800, 1.0, persistence), PERIOD).lines)
        for seed in range(300)
    ]
    assert np.mean(np.array(found) > 0) < 0.03


def test_two_lines_beside_each_other_are_told_apart_and_ranked():
    rng = np.random.default_rng(5)
    t = PERIOD * np.arange(3000)
    signal = 3 * np.sin(2 * np.pi * 0.6 * t) + np.sin(2 * np.pi * 0.9 * t + 1) + rng.normal(0, 0.5, len(t))
    first, second = spectrum(signal, PERIOD).lines[:2]
    assert first.frequency == pytest.approx(0.6, abs=2e-3)
    assert first.amplitude == pytest.approx(3.0, rel=0.03)
    assert second.frequency == pytest.approx(0.9, abs=5e-3)
    assert second.amplitude == pytest.approx(1.0, rel=0.1)


def test_the_density_of_white_noise_holds_its_variance():
    found = spectrum(np.random.default_rng(6).normal(0, 2.0, 4000), PERIOD)
    assert np.trapezoid(found.density, found.frequency) == pytest.approx(4.0, rel=0.1)
    assert np.median(found.density) == pytest.approx(4.0 * 2 * PERIOD, rel=0.15)


def test_along_the_path_a_gears_ripple_has_its_wavelength_whatever_the_speed():
    rng = np.random.default_rng(7)
    t = PERIOD * np.arange(2500)
    s = 0.01 * t + 0.02 * (1 - np.cos(0.3 * t)) / 2  # the feed changes on the way
    error = 5e-6 * np.sin(2 * np.pi * s / 0.008) + rng.normal(0, 2e-6, len(t))
    even, spacing = even_samples(s, error[:, None])
    line = spectrum(even[:, 0], spacing).lines[0]
    assert 1 / line.frequency == pytest.approx(0.008, rel=2e-3)
    in_time = spectrum(error, PERIOD).lines
    assert not in_time or in_time[0].amplitude < 0.9 * line.amplitude


def test_a_few_samples_are_refused():
    with pytest.raises(ValueError, match="20 samples have no spectrum"):
        spectrum(np.zeros(20), 1.0)
