"""Spectra of a path error, over time or along the path, and the lines in them ([F] fig. 10b: 0.6 Hz).

Multitaper (Thomson 1982, 10.1109/PROC.1982.12433): a line raises all eigenspectra alike and passes his F
test; coloured noise does not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from metro.units import Array

BANDWIDTH = (4.0, 8.0)  # of the tapers, in frequency steps of the record: of short ones and of long ones
FINER = 8  # zero padding
CHANCE = 0.01  # of any false line in a spectrum
MOST = 8
FEWEST = 32
WAVES = 2.0  # a line has at least so many periods in the record


@dataclass(frozen=True)
class Line:
    """A periodic part of a channel.

    Attributes
    ----------
    frequency, frequency_sd : cycles per unit of the spacing. amplitude, amplitude_sd : unit of the channel.
    probability : of a line as strong anywhere in a spectrum of noise.
    """

    frequency: float
    frequency_sd: float
    amplitude: float
    amplitude_sd: float
    probability: float


@dataclass(frozen=True, eq=False)
class Spectrum:
    """One-sided power spectral density of a channel with its lines in place, and the lines.

    Attributes
    ----------
    frequency : (m,) cycles per unit. density : (m,) unit² per (cycle per unit).
    lines : significant ones, the strongest first.
    """

    frequency: Array
    density: Array
    lines: tuple[Line, ...]


def spectrum(channel: Array, spacing: float) -> Spectrum:
    """Spectrum and lines of an evenly sampled channel (n,), about its straight line.

    Lines are taken out one after the other, the strongest first, for their leakage not to hide the next.

    Raises
    ------
    ValueError
        If there are fewer than 32 samples.
    """
    count = len(channel)
    if count < FEWEST:
        raise ValueError(f"{count} samples have no spectrum, expected at least {FEWEST}")
    residual = _levelled(channel)
    frequency, density, _ = _multitaper(residual, spacing)
    frequencies: list[float] = []
    chances: list[float] = []
    while len(frequencies) < MOST:
        place, chance = _strongest(residual, spacing)
        # The remainder of a line that was taken out a little beside its frequency is not another line.
        if chance > CHANCE or any(abs(place - f) < 1 / (count * spacing) for f in frequencies):
            break
        frequencies.append(place)
        chances.append(chance)
        frequencies = _refined(channel, spacing, frequencies)
        residual = channel - _fit(channel, spacing, frequencies)[0]
    return Spectrum(frequency, density, _lines(channel, residual, spacing, frequencies, chances))


def even_samples(place: Array, values: Array) -> tuple[Array, float]:
    """Channels (m, k) at even places from samples (n, k) at rising ones, as many, and their spacing."""
    count = len(place)
    even = np.linspace(place[0], place[-1], count)
    resampled = np.stack([np.interp(even, place, column) for column in values.T], axis=1)
    return resampled, float(even[1] - even[0])


def _multitaper(channel: Array, spacing: float) -> tuple[Array, Array, Array]:
    """Frequencies (m,), density (m,) and F statistic (m,) of a line at each, with 2 and 2 K − 2 dof.

    The more tapers K, the better the noise around a line is known, and the wider is what is called around.
    """
    count = len(channel)
    tapers = _tapers(count)
    size = FINER * count
    transform = np.fft.rfft(tapers * channel, size, axis=1)
    gain = tapers.sum(axis=1)
    mean = gain @ transform / (gain @ gain)
    left = (np.abs(transform - gain[:, None] * mean) ** 2).sum(axis=0)
    statistic = (len(tapers) - 1) * np.abs(mean) ** 2 * (gain @ gain) / np.maximum(left, 1e-300)
    density = 2 * spacing * (np.abs(transform) ** 2).mean(axis=0)
    return np.asarray(np.fft.rfftfreq(size, spacing), dtype=float), density, statistic


@cache
def _tapers(count: int) -> Array:
    from scipy.signal.windows import dpss

    return np.asarray(dpss(count, _bandwidth(count), int(2 * _bandwidth(count)) - 1))


def _bandwidth(count: int) -> float:
    return float(np.clip(math.sqrt(count) / 6.0, *BANDWIDTH))


def _strongest(channel: Array, spacing: float) -> tuple[float, float]:
    """Frequency of the most significant line, and the chance (Bonferroni's bound) of one such in noise."""
    from scipy.stats import f as fisher

    frequency, _, statistic = _multitaper(channel, spacing)
    count = len(channel)
    inside = (frequency >= WAVES / (count * spacing)) & (frequency <= 0.5 / spacing - 1 / (count * spacing))
    place = int(np.argmax(np.where(inside, statistic, -1.0)))
    one = float(fisher.sf(statistic[place], 2, 2 * len(_tapers(count)) - 2))
    return float(frequency[place]), min(1.0, one * int(inside.sum()))


def _refined(channel: Array, spacing: float, start: list[float]) -> list[float]:
    """Frequencies of least squares, all lines together."""
    from scipy.optimize import minimize

    width = 1 / (len(channel) * spacing)

    def residual_power(change: Array) -> float:
        residual = (
            channel - _fit(channel, spacing, [f + width * c for f, c in zip(start, change, strict=True)])[0]
        )
        return float(residual @ residual)

    size = residual_power(np.zeros(len(start))) + 1e-300
    best = minimize(
        lambda c: residual_power(c) / size, np.zeros(len(start)), bounds=[(-1.0, 1.0)] * len(start)
    )
    return [f + width * float(c) for f, c in zip(start, best.x, strict=True)]


def _fit(channel: Array, spacing: float, frequencies: list[float]) -> tuple[Array, Array]:
    """Fit sines of given frequencies on a straight line: the fit (n,), the sines' coefficients (lines, 2)."""
    time = spacing * np.arange(len(channel))
    angle = 2 * np.pi * np.outer(time, frequencies)
    line = np.column_stack([np.ones(len(time)), np.linspace(-1, 1, len(time))])
    design = np.column_stack([line, np.cos(angle), np.sin(angle)])
    weights = np.linalg.lstsq(design, channel, rcond=None)[0]
    return design @ weights, weights[2:].reshape(2, -1).T


def _lines(
    channel: Array, residual: Array, spacing: float, frequencies: list[float], chances: list[float]
) -> tuple[Line, ...]:
    """Amplitudes and errors of the lines: the Cramér–Rao bounds for the noise density at each.

    With the one-sided density S and the duration T, var f = 3 S / (π² A² T³) and var A = S / T.
    """
    if not frequencies:
        return ()
    frequency, density, _ = _multitaper(_levelled(residual), spacing)
    duration = spacing * len(channel)
    _, weights = _fit(channel, spacing, frequencies)
    lines = []
    for place, chance, amplitude in zip(frequencies, chances, np.hypot(*weights.T), strict=True):
        near = np.abs(frequency - place) < 2 * _bandwidth(len(channel)) / duration
        # what was taken out leaves a hole one step wide: the noise is that on both sides
        noise = float(np.mean(density[near & (np.abs(frequency - place) > 1 / duration)]))
        sd = math.sqrt(3 * noise / (math.pi**2 * amplitude**2 * duration**3))
        lines.append(Line(place, sd, float(amplitude), math.sqrt(noise / duration), chance))
    return tuple(sorted(lines, key=lambda line: -line.amplitude))


def _levelled(channel: Array) -> Array:
    place = np.linspace(-1, 1, len(channel))
    return np.asarray(channel - np.polyval(np.polyfit(place, channel, 1), place))
