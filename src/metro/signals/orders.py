"""Order tracking: the true spindle speed, and the part of a signal that repeats with every revolution.

A record is described by its Fourier coefficients at the orders 0…H of the spindle. They are stored per axis
as ``[mean, c₁, s₁, c₂, s₂, …]``, the cosine and sine amplitudes divided by √2, so that the sum of their
squares is the mean square of the waveform: a residual has the same size in orders as over angles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from metro.units import Array

SPEED_SEARCH = 0.006
REVOLUTIONS_PER_SEGMENT = 4.0


@dataclass(frozen=True)
class OrderAverage:
    """The revolution-synchronous average of one time block of a record.

    Attributes
    ----------
    value : (channels, 2H+1) order coefficients.
    variance : (channels, 2H+1) squared standard error of ``value``.
    middle : time at the middle of the block, s.
    """

    value: Array
    variance: Array
    middle: float


def order_matrix(angle: Array, highest: int) -> Array:
    """Matrix (n, 2·highest+1) that makes a waveform from its order coefficients; ``angle`` (n,) in rad."""
    matrix = np.empty((len(angle), 2 * highest + 1))
    matrix[:, 0] = 1.0
    phase = np.exp(1j * angle)
    power = np.ones_like(phase)
    for order in range(1, highest + 1):
        power = power * phase
        matrix[:, 2 * order - 1] = math.sqrt(2.0) * power.real
        matrix[:, 2 * order] = math.sqrt(2.0) * power.imag
    return matrix


def to_orders(waveform: Array, highest: int) -> Array:
    """Order coefficients (2·highest+1, …) of a waveform (angles, …) at even angles over one revolution."""
    spectrum = np.fft.rfft(waveform, axis=0)[: highest + 1] / len(waveform)
    coefficients = np.empty((2 * highest + 1, *waveform.shape[1:]))
    coefficients[0] = spectrum[0].real
    coefficients[1::2] = math.sqrt(2.0) * spectrum[1:].real
    coefficients[2::2] = -math.sqrt(2.0) * spectrum[1:].imag
    return coefficients


def advance(coefficients: Array, angle: float) -> Array:
    """Order coefficients of f(α + angle) from those of f(α); first axis (2H+1)."""
    order = np.arange(1, (len(coefficients) + 1) // 2)
    shape = (-1,) + (1,) * (coefficients.ndim - 1)
    cosine, sine = np.cos(order * angle).reshape(shape), np.sin(order * angle).reshape(shape)
    shifted = np.array(coefficients, dtype=float)
    shifted[1::2] = cosine * coefficients[1::2] + sine * coefficients[2::2]
    shifted[2::2] = cosine * coefficients[2::2] - sine * coefficients[1::2]
    return shifted


def highest_order(rate: float, revolutions_per_s: float, teeth: int) -> int:
    """Highest order that is worth keeping: six tooth passings, below 0.4 of the sampling rate, at most 48."""
    return max(1, min(48, max(24, 6 * teeth), int(0.4 * rate / revolutions_per_s)))


def _segments(time: Array, revolutions_per_s: float, per_segment: float) -> list[slice]:
    """Cut a record into whole segments of about ``per_segment`` revolutions."""
    count = max(1, int((time[-1] - time[0]) * revolutions_per_s / per_segment))
    edges = np.searchsorted(time, np.linspace(time[0], time[-1], count + 1))
    edges[-1] = len(time)
    return [slice(a, b) for a, b in pairwise(edges)]


def spindle_speed(time: Array, signal: Array, nominal: float, highest: int) -> tuple[float, float]:
    """Estimate the true speed from the signal alone: the speed that gathers most energy at its orders.

    Parameters
    ----------
    time : (n,) s. signal : (n, channels). nominal : revolutions per second, off by up to 0.6 %. highest :
        order.

    Returns
    -------
    speed, its standard deviation : revolutions per second; NaN deviation where there are fewer than six
        segments.
    """
    speed = nominal
    for _ in range(2):
        pieces = _segments(time, speed, REVOLUTIONS_PER_SEGMENT)
        middle = np.array([time[piece].mean() for piece in pieces])
        order = np.arange(1.0, highest + 1)
        spectra = np.stack(
            [
                np.exp(-2j * math.pi * speed * order[:, None] * time[None, piece]) @ _centred(signal[piece])
                for piece in pieces
            ]
        )
        duration = time[-1] - time[0]
        step = 0.1 / (highest * duration)
        span = SPEED_SEARCH * nominal if speed == nominal else 20 * step
        trial = np.arange(-span, span + step / 2, step)
        energy = np.array([_gathered(spectra, order, middle, shift) for shift in trial])
        best = int(np.argmax(energy))
        shift = trial[best]
        if 0 < best < len(trial) - 1:
            left, mid, right = energy[best - 1 : best + 2]
            shift += 0.5 * step * (left - right) / (left - 2 * mid + right)
        speed += float(shift)
    return speed, _speed_deviation(spectra, order, middle, shift)


def _centred(piece: Array) -> Array:
    return np.asarray(piece - piece.mean(axis=0))


def _gathered(spectra: Array, order: Array, middle: Array, shift: float) -> float:
    turned = np.exp(-2j * math.pi * shift * middle[:, None] * order[None, :])
    return float(np.sum(np.abs(np.einsum("sk,skc->kc", turned, spectra)) ** 2))


def _speed_deviation(spectra: Array, order: Array, middle: Array, shift: float) -> float:
    """Return the speed's standard deviation, from the strongest order's phase about a straight line."""
    if len(middle) < 6:
        return math.nan
    power = np.abs(spectra.sum(axis=0)) ** 2
    k, channel = np.unravel_index(int(np.argmax(power)), power.shape)
    phase = np.unwrap(np.angle(spectra[:, k, channel] * np.exp(-2j * math.pi * shift * middle * order[k])))
    centred = middle - middle.mean()
    slope = centred @ phase / (centred @ centred)
    rest = phase - phase.mean() - slope * centred
    sd = math.sqrt(rest @ rest / (len(middle) - 2) / (centred @ centred))
    return float(sd / (2.0 * math.pi * order[k]))


def order_averages(time: Array, angle: Array, signal: Array, highest: int, blocks: int) -> list[OrderAverage]:
    """Average a record over its revolutions, in time blocks, with the error of each coefficient.

    Each block is cut into segments of a few revolutions; the scatter of the segments gives the error of their
    mean. It is pooled over the blocks (whose means are each taken out) and drawn towards its neighbouring
    orders, since the scatter of few segments is itself uncertain.

    Parameters
    ----------
    time : (n,) s. angle : (n,) rad, of the spindle relative to the feed. signal : (n, channels).
    highest : order. blocks : number of time blocks.
    """
    revolutions = (angle[-1] - angle[0]) / (2.0 * math.pi)
    blocks = max(1, blocks)
    per_s = revolutions / (time[-1] - time[0])
    edges = np.searchsorted(time, np.linspace(time[0], time[-1], blocks + 1))
    edges[-1] = len(time)
    means, counts, middles, freedom = [], [], [], 0
    squares = np.zeros((signal.shape[1], 2 * highest + 1))
    for start, end in pairwise(edges):
        pieces = _segments(
            time[start:end], per_s, max(REVOLUTIONS_PER_SEGMENT, (2 * highest + 20) / len(time) * revolutions)
        )
        values = np.stack([_fit(angle[start:end][p], signal[start:end][p], highest) for p in pieces])
        means.append(values.mean(axis=0))
        counts.append(len(pieces))
        middles.append(float(time[start:end].mean()))
        squares += ((values - means[-1]) ** 2).sum(axis=0)
        freedom += len(pieces) - 1
    variance = _shrunk(squares / max(freedom, 1), freedom)
    return [
        OrderAverage(mean, variance / count, middle)
        for mean, count, middle in zip(means, counts, middles, strict=True)
    ]


def _fit(angle: Array, signal: Array, highest: int) -> Array:
    return np.asarray(np.linalg.lstsq(order_matrix(angle, highest), signal, rcond=None)[0].T)


def _shrunk(variance: Array, freedom: int, prior_freedom: int = 6) -> Array:
    """Draw each order's variance, (channels, 2H+1), towards the median of five orders on each side."""
    padded = np.pad(variance, ((0, 0), (10, 10)), mode="edge")
    neighbours = np.median(np.lib.stride_tricks.sliding_window_view(padded, 21, axis=1), axis=2)
    return np.asarray((freedom * variance + prior_freedom * neighbours) / (freedom + prior_freedom))
