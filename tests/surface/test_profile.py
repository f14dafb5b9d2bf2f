"""The Gaussian profile filter against ISO 16610-21 and what is measured in metrology.md."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.surface.profile import KERNEL_SD, even, gaussian_filter, noise_gain, part

SPACING = 0.05
X = np.arange(0, 400, SPACING)
MIDDLE = slice(2000, 6000)


def transmission(wavelength, cutoff=8.0):
    wave = np.exp(2j * np.pi * X / wavelength)
    passed = gaussian_filter(np.column_stack([wave.real, wave.imag]), SPACING, cutoff)
    return np.abs(passed @ [1, 1j])[MIDDLE].mean()


def test_half_of_a_wave_at_the_cutoff_passes():
    assert transmission(8.0) == pytest.approx(0.5, abs=0.0005)


@pytest.mark.parametrize("wavelength", [2.5, 4.0, 6.0, 12.0, 25.0])
def test_transmission_follows_the_standard(wavelength):
    """ISO 16610-21: exp(−π (α λc/λ)²) with α = √(ln 2/π) = 0.4697."""
    expected = np.exp(-np.pi * (0.469718639 * 8.0 / wavelength) ** 2)
    assert transmission(wavelength) == pytest.approx(expected, abs=0.0005)


@given(st.floats(-50, 50), st.floats(-3, 3), st.sampled_from([0.8, 8.0, 30.0]), st.integers(40, 3000))
@settings(max_examples=40, deadline=None)
def test_a_straight_line_passes_unchanged_to_the_very_ends(height, slope, cutoff, points):
    line = height + slope * X[:points]
    np.testing.assert_allclose(gaussian_filter(line, SPACING, cutoff), line, atol=1e-6)


def test_the_ends_are_the_weighted_regression_line():
    rng = np.random.default_rng(1)
    z = rng.normal(size=300)
    sd = KERNEL_SD * 8.0
    for i in (0, 30, 299):
        weight = np.sqrt(np.exp(-0.5 * ((X[:300] - X[i]) / sd) ** 2))
        line = np.polyfit(X[:300] - X[i], z, 1, w=weight)
        assert gaussian_filter(z, SPACING, 8.0)[i] == pytest.approx(line[1], abs=2e-3)


def test_the_kernel_is_that_of_the_standard():
    assert pytest.approx(0.18739, abs=5e-6) == KERNEL_SD


def test_the_bands_add_up_to_the_profile_and_part_its_waves():
    mm = 1e-3
    long, middle, short = (a * np.sin(2 * np.pi * X / w) for a, w in ((100, 60), (8, 2.5), (1, 0.3)))
    bands = part(long + middle + short, SPACING * mm, 8 * mm)
    np.testing.assert_allclose(
        bands.deformation + bands.waviness + bands.roughness, long + middle + short, atol=1e-9
    )
    np.testing.assert_allclose(bands.deformation[MIDDLE], long[MIDDLE], atol=1.5)
    np.testing.assert_allclose((bands.waviness - middle)[MIDDLE], 0, atol=2.5)
    assert np.corrcoef(bands.roughness[MIDDLE], short[MIDDLE])[0, 1] > 0.8


def test_white_noise_is_lowered_by_the_stated_gain():
    noise = np.random.default_rng(2).normal(size=(len(X), 40))
    found = gaussian_filter(noise, SPACING, 8.0)[MIDDLE].std()
    assert found == pytest.approx(noise_gain(SPACING, 8.0), rel=0.05)


def test_an_uneven_trace_is_brought_to_even_spacing():
    x = np.array([0.3, 0.0, 0.1, 0.2, 0.4, 0.6, 0.5, 0.7, 0.8, 0.82])
    grid, z = even(x, 2 * x)
    np.testing.assert_allclose(np.diff(grid), np.diff(grid)[0])
    np.testing.assert_allclose(z, 2 * grid)


def test_a_gap_in_a_trace_is_refused_with_its_place():
    x = np.concatenate([np.arange(0, 10, 0.1), np.arange(15, 20, 0.1)])
    with pytest.raises(ValueError, match=r"gap of 5\.1 after x = 9\.9"):
        even(x, x)
