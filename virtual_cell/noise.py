"""Sensor noise: white, with some 1/f under it."""

from __future__ import annotations

import numpy as np

from virtual_cell.units import Array


def sensor_noise(count: int, sigma: float, rng: np.random.Generator, pink: float = 0.3) -> Array:
    """Return noise (count,) of standard deviation ``sigma``, plus 1/f noise of ``pink`` times that."""
    white = rng.standard_normal(count)
    spectrum = np.fft.rfft(rng.standard_normal(count))
    spectrum /= np.sqrt(np.maximum(np.arange(len(spectrum)), 1.0))
    spectrum[0] = 0.0
    slow = np.fft.irfft(spectrum, count)
    noise: Array = sigma * (white + pink * slow / max(float(slow.std()), 1e-30))
    return noise


def quantised(values: Array, step: float) -> Array:
    """Round to a converter's step."""
    rounded: Array = np.round(values / step) * step
    return rounded
