"""The spindle speed of the signal against the run table.

The period of a force record is that of the teeth, or of the revolution where the teeth differ. A table that
says another speed (10 % off, rpm for rev/s, a time axis at half the rate) gives a revolution with which the
force does not repeat, or so many repeats in it that no tool has as many teeth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from metro.units import Array

MOST_SAMPLES = 1 << 17
REPEATS = 0.9  # of the best repetition: lags from which on a period counts as one
PERIODIC = 0.8  # autocorrelation of a record that repeats; noise and resonance reach 0.78, at a vague lag
MISSED = 0.5  # of the best repetition: at the declared revolution, a record of that speed has far more
MISCOUNTED = 2.0  # declared teeth that are one: who counts teeth takes pairs for single ones, and no more
ALL_OF_IT = 0.97  # of the best repetition, at a period too short for teeth: ringing between teeth has less
LINES = 12  # orders of the declared revolution at which the teeth or runout would be seen, or one per tooth
FALSE_ALARM = 1e-4  # probability that noise makes lines at these orders as strong
TOLERANCE = 0.015  # of the speed: 0.6 % by which a spindle may differ, and as much again for rounding of lags

_LEAK = 2  # bins to either side into which a Hann taper spreads a line


@dataclass(frozen=True)
class Period:
    """The period of a record.

    Attributes
    ----------
    length : s. repeats : autocorrelation at the best of all lags, 0 … 1; ``at_length``, ``at_revolution``:
        after this period, and after one declared revolution.
    """

    length: float
    repeats: float
    at_length: float
    at_revolution: float


def period(signal: Array, rate: float, revolution: float) -> Period | None:
    """Return the shortest lag at which a record (n, channels) repeats; None where it does not.

    Parameters
    ----------
    rate : Hz. revolution : declared length of a revolution, s.
    """
    signal = signal[:MOST_SAMPLES] - signal[:MOST_SAMPLES].mean(axis=0)
    size = signal.std(axis=0)
    match = _autocorrelation(signal[:, size > 0.0] / size[size > 0.0])
    lowest = int(np.argmax(match < 0.5 * match[0])) if match.size else 0
    if lowest == 0:
        return None
    inner = match[lowest:]
    best = float(inner.max())
    peaks = 1 + np.flatnonzero((inner[1:-1] >= inner[:-2]) & (inner[1:-1] >= inner[2:]))
    strong = peaks[inner[peaks] >= REPEATS * best] if len(peaks) else peaks
    if best < PERIODIC or not len(strong):
        return None
    first = lowest + int(strong[0])
    length = _refined(match, first)
    near = match[_window(revolution * rate, len(match))]
    return Period(length / rate, best, float(match[first]), float(near.max(initial=-1.0)))


def turns_as_declared(signal: Array, rate: float, revolution: float, found: Period, teeth: int) -> bool:
    """Whether a record has lines at orders of the declared revolution besides those of the period found.

    Then the spindle turns as declared, and the period is that of a vibration that is stronger than the force
    of the teeth: chatter. A spindle that turns at another speed makes no line there but by chance: orders
    within the resolution of a multiple of the period found are left out, and the power at the others, at the
    best speed within ``TOLERANCE``, is compared with the median about each, as noise would have it.

    Parameters
    ----------
    signal, rate, revolution : as of :func:`period`, which gave ``found``. teeth : of the tool.
    """
    from scipy.stats import gamma

    signal = signal[:MOST_SAMPLES]
    taper = np.hanning(len(signal))[:, None]
    power = (np.abs(np.fft.rfft((signal - signal.mean(axis=0)) * taper, axis=0)) ** 2).sum(axis=1)
    turns = len(signal) / (rate * revolution)  # bins from order to order
    about = max(3, round(0.5 * turns))
    best, lines = 0.0, max(LINES, teeth)
    speeds = np.arange(1.0 - TOLERANCE, 1.0 + TOLERANCE, 0.25 / (lines * turns))
    for speed in speeds:
        place = np.rint(np.arange(1, lines + 1) * turns * speed).astype(int)
        multiples = place * found.length * rate / len(signal)
        own = np.abs(multiples - np.round(multiples)) * len(signal) / (found.length * rate) > 2.0 * _LEAK
        place = place[own & (place > _LEAK) & (place + about < len(power))]
        floor = [np.median(power[max(bin_ - about, 1) : bin_ + about]) / math.log(2.0) for bin_ in place]
        chance = gamma.sf(float((power[place] / floor).sum()), len(place)) if len(place) else 1.0
        best = max(best, -math.log(max(float(chance) * len(speeds), 1e-300)))
    return best > -math.log(FALSE_ALARM)


def _autocorrelation(signal: Array) -> Array:
    """Mean over channels of the autocorrelation (lags up to half the record), 1 at lag 0."""
    count = len(signal)
    spectrum = np.fft.rfft(signal, 2 * count, axis=0)
    sums = np.fft.irfft((np.abs(spectrum) ** 2).sum(axis=1))[: count // 2]
    overlap = count - np.arange(len(sums))
    return np.asarray(sums / overlap / max(sums[0] / count, 1e-300)) if len(sums) else np.zeros(0)


def _refined(match: Array, first: int) -> float:
    """Period in samples, from the peaks at its multiples: each doubles the resolution."""
    length, times = _peak(match, first), 1
    while 2.5 * times * length < len(match) - 2:
        times *= 2
        near = match[_window(times * length, len(match), 0.5 / times)]
        start = _window(times * length, len(match), 0.5 / times).start
        if len(near) < 1 or near.max() < MISSED * match[first]:
            break
        length = _peak(match, start + int(np.argmax(near))) / times
    return length


def _peak(match: Array, place: int) -> float:
    """Place of a peak between samples, by a parabola."""
    if not 0 < place < len(match) - 1:
        return float(place)
    left, middle, right = match[place - 1 : place + 2]
    bend = left - 2.0 * middle + right
    return place + (0.5 * (left - right) / bend if bend < 0.0 else 0.0)


def _window(lag: float, count: int, share: float = TOLERANCE) -> slice:
    """Lags within a share of one, at least a sample to either side."""
    half = max(1.0, share * lag)
    return slice(max(0, round(lag - half)), min(count, round(lag + half) + 1))


def repeats_per_revolution(found: Period, revolution: float, teeth: int) -> float | None:
    """Return how often a record repeats in a declared revolution; None where a cutter may repeat so often.

    It may where the record repeats after the revolution, and not more often in it than a tool of so many
    teeth may have, were they miscounted.
    """
    passes = revolution / found.length
    if found.at_revolution <= MISSED * found.repeats:
        return passes
    too_often = passes > (MISCOUNTED + TOLERANCE) * teeth
    return passes if too_often and found.at_length >= ALL_OF_IT * found.repeats else None
