"""Waviness as a sum of waves: its parameters, a basis in which white noise stays white, and noise in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array

NEIGHBOURS = 15  # waves over which the power of a signal is taken to be even


@dataclass(frozen=True)
class Waviness:
    """ISO 21920-2: mean height ``wa``, root mean square ``wq``, and peak to valley ``wt``, m."""

    wa: float
    wq: float
    wt: float


def waviness(profile: Array) -> Waviness:
    """Parameters of a waviness profile (n,), m, about its mean."""
    about = profile - profile.mean()
    return Waviness(float(np.abs(about).mean()), float(np.sqrt(np.mean(about**2))), float(np.ptp(about)))


def wave_basis(count: int, spacing: float, shortest: float, longest: float) -> tuple[Array, Array]:
    """Orthonormal waves (cosines of the DCT-II) over evenly spaced points.

    Projected on them, white noise stays white, whatever the band: neighbouring points of a band-passed
    profile do not have that.

    Parameters
    ----------
    count, spacing : of the points. shortest, longest : wavelengths that are kept, in the unit of ``spacing``.

    Returns
    -------
    tuple
        The waves (n, count), rows of unit length, and their wavelengths (n,), falling.
    """
    every = np.arange(1, count)
    length = 2.0 * count * spacing / every
    kept = (length >= shortest) & (length <= longest)
    phase = np.pi / count * np.outer(every[kept], np.arange(count) + 0.5)
    return np.sqrt(2.0 / count) * np.cos(phase), length[kept]


def white_noise(series: Array) -> float:
    """Variance of the white noise on a smooth series (n,): a twentieth of its third differences' square."""
    return float(np.mean(np.diff(series, n=3) ** 2) / 20.0)


def signal_share(waves: Array, noise: float, most: Array) -> Array:
    """Share w (n,) of each wave that may be signal: Wiener's S/(S + N).

    S is the mean power of the neighbouring waves less that of the noise, and one standard error of that mean
    more: a signal that is not seen in the noise may still be there. It is no more than the power of ``most``
    either, whose waves have the signal in them. ``w × waves`` is then off the signal by a variance of w N at
    most, and a regression on it is hardly biased by the noise (regression calibration).

    Parameters
    ----------
    waves : (n,) a reading, wave by wave. noise : N, the variance of the noise on each. most : (n,) another
        reading of the signal, with next to no noise but with more than the signal in it.
    """
    if noise <= 0.0:
        return np.ones_like(waves)
    window = np.ones(min(NEIGHBOURS, len(waves)))
    count = _moving_sum(np.ones(len(waves)), window)
    error = np.sqrt(2.0 / count)
    seen = np.maximum(_moving_sum(waves**2, window) / count - noise, 0.0) + noise * error
    bound = _moving_sum(most**2, window) / count * (1.0 + error)
    signal = np.minimum(seen, bound)
    return np.asarray(signal / (signal + noise))


def _moving_sum(values: Array, window: Array) -> Array:
    return np.asarray(np.convolve(values, window, mode="same"))
