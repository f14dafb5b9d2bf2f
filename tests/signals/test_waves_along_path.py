"""Waves of a series along a path, and the level of noise whose variance goes with their length."""

import numpy as np
import pytest

from metro.signals.waves import variance, wandering, waves


def test_a_half_wave_of_the_path_is_one_wave():
    place = (np.arange(64) + 0.5) / 64
    found = waves(np.cos(3.0 * np.pi * place)[:, None])[:, 0]
    assert np.flatnonzero(np.abs(found) > 1e-9).tolist() == [3]
    assert found[3] ** 2 == pytest.approx(32.0)  # orthonormal: the power of the series


def test_white_noise_is_white_in_waves():
    found = waves(np.random.default_rng(1).normal(size=(128, 400)))
    assert found.var(axis=1) == pytest.approx(np.ones(128), abs=0.3)
    assert np.corrcoef(found)[np.triu_indices(128, 1)].std() == pytest.approx(400**-0.5, rel=0.1)


def drawn(count, white, wander, channels):
    """Series drawn from the waves that the noise is said to have."""
    sd = np.sqrt(variance(count, np.full(channels, white), np.full(channels, wander)))
    basis = waves(np.eye(count))
    return basis.T @ (sd * np.random.default_rng(2).normal(size=(count, channels)))


@pytest.mark.parametrize("wander", [20.0, 50.0])
def test_the_level_is_found_beside_a_smooth_signal_and_a_step(wander):
    place = np.linspace(-1.0, 1.0, 140)
    step = np.sign(place - 0.2)[:, None]
    series = drawn(140, 1.0, wander, 300) + (800.0 + 30.0 * place**2)[:, None] + 26.0 * step
    found = wandering(series, np.ones(300), step)
    assert found.mean() == pytest.approx(wander, rel=0.15)


@pytest.mark.parametrize(("wander", "low", "high"), [(0.0, 0.0, 1.5), (5.0, 3.5, 6.5)])
def test_a_level_about_the_white_noise_is_told_to_the_size_of_that(wander, low, high):
    """No level is below zero, and the smooth signal takes its share of the long waves."""
    found = wandering(drawn(140, 1.0, wander, 300), np.ones(300), np.zeros((140, 0)))
    assert low <= found.mean() <= high


def test_a_short_series_tells_nothing():
    series = 30.0 * np.random.default_rng(3).normal(size=(19, 3))
    assert wandering(series, np.ones(3), np.zeros((19, 0))).tolist() == [0.0, 0.0, 0.0]


def test_slow_noise_goes_with_the_length_of_the_wave_and_the_mean_is_a_wave_of_twice_the_longest():
    found = variance(5, np.array([1.0, 0.0]), np.array([0.0, 6.0]))
    assert found[:, 0] == pytest.approx(np.ones(5))
    assert found[:, 1] == pytest.approx([12.0, 6.0, 3.0, 2.0, 1.5])
