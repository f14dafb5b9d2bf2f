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


def signal_share(
    readings: Array, noise: Array, whole: Array, whole_noise: float = 0.0
) -> tuple[Array, Array, Array]:
    """Share w (n, k) of each wave of several readings that is signal, Wiener's S/(S + N), and its error.

    S is the mean power of the neighbouring waves less that of the noise, where it is more than chance gives
    to one of as many waves, and none elsewhere: noise that passed would be an error by all of itself,
    and a regression on it would be pulled to zero. What passes has an error of variance w² N, what does not
    by (1 − w)² S with as much S as is seen and one standard error more. All readings together leave no more
    than ``whole`` has, whose waves are the sum of the signals: its power less what passed, and its noise.

    Parameters
    ----------
    readings : (n, k) wave by wave. noise : N (k,), the variance of the noise on each. whole : (n,) a reading
        of the sum of the k signals, which may have more in it. whole_noise : variance of its noise.

    Returns
    -------
    tuple
        w (n, k), and the error of the sum of w times the readings as a sum of the signals: the variance (n,)
        of the signal that does not pass, and that of the noise which does.
    """
    from scipy.stats import chi2

    size = len(whole)
    window = np.ones(min(NEIGHBOURS, size))
    count = _moving_sum(np.ones(size), window)
    error = np.sqrt(2.0 / count)

    def most(waves: Array) -> Array:
        power = _moving_sum(waves**2, window) / count
        return np.asarray(np.maximum(power * (1.0 + error) - whole_noise, 0.0))

    share, missed = np.ones(readings.shape), np.zeros(size)
    for i in np.flatnonzero(noise > 0.0):
        power = _moving_sum(readings[:, i] ** 2, window) / count
        beyond = power * count > noise[i] * chi2.isf(1.0 / size, count)
        signal = np.where(beyond, np.minimum(power - noise[i], most(whole)), 0.0)
        share[:, i] = signal / (signal + noise[i])
        missed += (1.0 - share[:, i]) ** 2 * (np.maximum(power - noise[i], 0.0) + noise[i] * error)
    missed = np.minimum(missed, most(whole - (share * readings).sum(axis=1)))
    return share, missed, share**2 @ noise


def _moving_sum(values: Array, window: Array) -> Array:
    return np.asarray(np.convolve(values, window, mode="same"))
