"""What a cable picks up on its way: the mains and its harmonics, and noise that rises to low frequencies."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.hidden import drawn_size
from virtual_cell.units import Array

HARMONICS = (1, 2, 3, 5, 7)


@dataclass(frozen=True)
class Pickup:
    """Electrical noise of a channel chain.

    Attributes
    ----------
    white : standard deviation, N, at the recorded rate. corner : frequency below which 1/f noise is above the
        white, Hz. mains : its frequency, Hz. hum : (3, harmonics) amplitudes, N.
    """

    white: float
    corner: float
    mains: float
    hum: Array


def drawn_pickup(white: float, rng: np.random.Generator) -> Pickup:
    """Draw what is picked up beside the white noise of a sensor."""
    each = np.array([0.2 + rng.uniform(0.0, 0.8, len(HARMONICS)) / np.array(HARMONICS) for _ in range(3)])
    total = np.sqrt((each**2).sum(axis=1, keepdims=True))
    size = np.array([[drawn_size(rng, 0.1, 5.0)] for _ in range(3)])
    return Pickup(white, drawn_size(rng, 1.0, 10.0), float(rng.choice([50.0, 60.0])), size * each / total)


def picked_up(pickup: Pickup, t: Array, rate: float, rng: np.random.Generator) -> Array:
    """Noise (n, 3), N, at times ``t`` (s) of a record at ``rate`` Hz: its grid runs on, its zero is known."""
    mains = pickup.mains * (1.0 + 0.0008 * float(rng.uniform(-1.0, 1.0)))
    phase = rng.uniform(0.0, 2.0 * math.pi, (3, len(HARMONICS)))
    angle = 2.0 * math.pi * mains * np.multiply.outer(t, np.array(HARMONICS))
    hum = np.stack([(np.sin(angle + phase[i]) * pickup.hum[i]).sum(axis=1) for i in range(3)], axis=1)
    return np.asarray(
        hum + pickup.white * np.stack([_flicker(pickup, len(t), rate, rng) for _ in range(3)], axis=1)
    )


def _flicker(pickup: Pickup, count: int, rate: float, rng: np.random.Generator) -> Array:
    """White noise of deviation 1 whose power rises as 1 + corner/f; slower than the record it has no more."""
    spectrum = np.fft.rfft(rng.standard_normal(count))
    hz = np.fft.rfftfreq(count, 1.0 / rate)
    hz[0] = hz[1]
    return np.asarray(np.fft.irfft(spectrum * np.sqrt(1.0 + pickup.corner / hz), count))
