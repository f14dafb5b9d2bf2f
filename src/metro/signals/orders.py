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

from metro.units import Array, ComplexArray

SPEED_SEARCH = 0.006
REVOLUTIONS_PER_SEGMENT = 4.0
FEWEST = 3  # segments, whose differences say how far each is from the middle of its neighbours
FINE_STEPS = 20  # to either side of the best of the search
WORTH = (0.0, 0.67, 0.51)  # degrees of freedom of a difference of first and second order, in white noise
NEWTON = 4  # steps to the best of the trials of an angle
PADDING = 16  # of the Fourier transform of the search: well below a step at the highest order


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
    rows = np.empty((2 * highest + 1, len(angle)))
    rows[0] = 1.0
    phase = np.exp(1j * angle)
    power = np.full_like(phase, math.sqrt(2.0))
    for order in range(1, highest + 1):
        power = power * phase
        rows[2 * order - 1] = power.real
        rows[2 * order] = power.imag
    return rows.T


def to_orders(waveform: Array, highest: int) -> Array:
    """Order coefficients (2·highest+1, …) of a waveform (angles, …) at even angles over one revolution."""
    spectrum = np.fft.rfft(waveform, axis=0)[: highest + 1] / len(waveform)
    coefficients = np.empty((2 * highest + 1, *waveform.shape[1:]))
    coefficients[0] = spectrum[0].real
    coefficients[1::2] = math.sqrt(2.0) * spectrum[1:].real
    coefficients[2::2] = -math.sqrt(2.0) * spectrum[1:].imag
    return coefficients


def amplitudes(coefficients: Array) -> ComplexArray:
    """Complex amplitudes (H+1, …) of the orders 0…H, of e^{+ikα}, from order coefficients (2H+1, …)."""
    return np.concatenate([coefficients[:1].astype(complex), coefficients[1::2] - 1j * coefficients[2::2]])


def from_amplitudes(waves: ComplexArray) -> Array:
    """Order coefficients (2H+1, …) from complex amplitudes (H+1, …): the inverse of :func:`amplitudes`."""
    coefficients = np.empty((2 * len(waves) - 1, *waves.shape[1:]))
    coefficients[0] = waves[0].real
    coefficients[1::2], coefficients[2::2] = waves[1:].real, -waves[1:].imag
    return coefficients


def advance(coefficients: Array, angle: float) -> Array:
    """Order coefficients of f(α + angle) from those of f(α); first axis (2H+1)."""
    waves = amplitudes(coefficients)
    turned = np.exp(1j * angle * np.arange(len(waves))).reshape(-1, *(1,) * (coefficients.ndim - 1))
    return from_amplitudes(waves * turned)


def aligned(coefficients: Array, like: Array) -> Array:
    """Turn order coefficients (channels, 2H+1) to where their waveform is most nearly that of ``like``."""
    spectra = [each[:, 1::2] - 1j * each[:, 2::2] for each in (coefficients, like)]
    cross = (spectra[0] * spectra[1].conj()).sum(axis=0)
    order = np.arange(1, len(cross) + 1)
    trial = np.linspace(0.0, 2.0 * math.pi, 2 * PADDING * len(cross), endpoint=False)
    match = (cross * np.exp(1j * np.outer(trial, order))).real.sum(axis=1)
    best = float(trial[np.argmax(match)])
    for _ in range(NEWTON):
        turned = cross * np.exp(1j * order * best)
        bend = float((order**2 * turned).real.sum())
        best -= float((order * turned).imag.sum()) / bend if bend > 0.0 else 0.0
    return advance(coefficients.T, best).T


def highest_order(rate: float, revolutions_per_s: float, teeth: int) -> int:
    """Highest order that is worth keeping: six tooth passings, at most 48.

    Below 0.3 of the sampling rate: above it, the filter that guards against aliasing shows.
    """
    return max(1, min(48, max(24, 6 * teeth), int(0.3 * rate / revolutions_per_s)))


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
    time : (n,) s. signal : (n, channels). nominal : revolutions per second, with an error of up to 0.6 %.
    highest : order.

    Returns
    -------
    speed, its standard deviation : revolutions per second. Fewer than six segments (of four revolutions)
        give a NaN deviation, a single one the nominal speed.
    """
    pieces = _segments(time, nominal, REVOLUTIONS_PER_SEGMENT)
    if len(pieces) < 2:  # there is nothing that could have turned
        return nominal, math.nan
    middle = np.array([time[piece].mean() for piece in pieces])
    step = 0.1 / (highest * (time[-1] - time[0]))
    span = SPEED_SEARCH * nominal
    trial = np.arange(-span, span + step / 2, step)
    spectra = _spectra(time, signal, pieces, nominal, highest)
    speed = nominal + float(trial[np.argmax(_roughly_gathered(spectra, middle, trial))])
    spectra = _spectra(time, signal, pieces, speed, highest)
    trial = step * np.arange(-FINE_STEPS, FINE_STEPS + 1)
    energy = np.array([_gathered(spectra, middle, shift) for shift in trial])
    best = int(np.argmax(energy))
    shift = float(trial[best])
    if 0 < best < len(trial) - 1:
        left, mid, right = energy[best - 1 : best + 2]
        shift += float(0.5 * step * (left - right) / (left - 2 * mid + right))
    return speed + shift, _speed_deviation(spectra, middle, shift)


def _spectra(time: Array, signal: Array, pieces: list[slice], speed: float, highest: int) -> ComplexArray:
    """Amplitudes of each segment at the orders 1…highest, (segments, orders, channels)."""
    parts = np.stack(
        [
            order_matrix(2.0 * math.pi * speed * time[piece], highest).T @ _centred(signal[piece])
            for piece in pieces
        ]
    )
    return np.asarray(parts[:, 1::2] - 1j * parts[:, 2::2])


def _centred(piece: Array) -> Array:
    return np.asarray(piece - piece.mean(axis=0))


def _orders(spectra: ComplexArray) -> Array:
    return np.arange(1.0, spectra.shape[1] + 1)


def _roughly_gathered(spectra: ComplexArray, middle: Array, trial: Array) -> Array:
    """Energy at the orders of each speed that differs by ``trial``, (trials,), from one Fourier transform.

    It takes the segments as evenly spaced, so that its cost grows with the record as the record does.
    """
    count = PADDING * len(spectra)
    power = (np.abs(np.fft.fft(spectra, count, axis=0)) ** 2).sum(axis=2)
    spacing = (middle[-1] - middle[0]) / (len(middle) - 1)
    order = _orders(spectra)
    place = np.rint(trial[:, None] * order * spacing * count).astype(int) % count
    return np.asarray(power[place, order.astype(int) - 1].sum(axis=1))


def _gathered(spectra: ComplexArray, middle: Array, shift: float) -> float:
    turned = np.exp(-2j * math.pi * shift * middle[:, None] * _orders(spectra)[None, :])
    return float(np.sum(np.abs(np.einsum("sk,skc->kc", turned, spectra)) ** 2))


def _speed_deviation(spectra: ComplexArray, middle: Array, shift: float) -> float:
    """Return the speed's standard deviation, from the strongest order's phase about a straight line."""
    if len(middle) < 6:
        return math.nan
    power = np.abs(spectra.sum(axis=0)) ** 2
    k, channel = np.unravel_index(int(np.argmax(power)), power.shape)
    order = float(k + 1)
    phase = np.unwrap(np.angle(spectra[:, k, channel] * np.exp(-2j * math.pi * shift * middle * order)))
    centred = middle - middle.mean()
    slope = centred @ phase / (centred @ centred)
    residual = phase - phase.mean() - slope * centred
    sd = math.sqrt(residual @ residual / (len(middle) - 2) / (centred @ centred))
    return float(sd / (2.0 * math.pi * order))


def order_averages(time: Array, angle: Array, signal: Array, highest: int, blocks: int) -> list[OrderAverage]:
    """Average a record over its revolutions, in time blocks, with the error of each coefficient.

    Each block is cut into segments of a few revolutions; how far each is from the middle of its neighbours
    gives the error of their mean: what changes slowly, or from block to block, is no error. Blocks of fewer
    than three segments are taken as one, and segments of a short record are shorter. It is drawn towards its
    neighbouring orders, since that of few segments is itself uncertain. A record that is one segment has the
    error that its samples show about their waveform.

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
    means, counts, middles = [], [], []
    segments: list[Array] = []
    enough = (2 * highest + 20) / len(time) * revolutions
    per_segment = max(min(REVOLUTIONS_PER_SEGMENT, revolutions / FEWEST), enough)
    for start, end in pairwise(edges):
        pieces = _segments(time[start:end], per_s, per_segment)
        within, record = angle[start:end], signal[start:end]
        values = np.stack([_fit(order_matrix(within[p], highest), record[p]) for p in pieces])
        means.append(values.mean(axis=0))
        counts.append(len(pieces))
        middles.append(float(time[start:end].mean()))
        segments.append(values)
    if min(counts) < FEWEST:
        segments = [np.concatenate(segments)]
    order = min(2, len(segments[0]) - 1)  # of the differences
    differences = np.concatenate([np.diff(part, order, axis=0) for part in segments]) ** 2
    differences /= math.comb(2 * order, order)
    freedom = WORTH[order] * len(differences)
    alone = _scatter(order_matrix(angle, highest), signal) if not freedom else differences.mean(axis=0)
    variance = _shrunk(alone, freedom)
    return [
        OrderAverage(mean, variance / count, middle)
        for mean, count, middle in zip(means, counts, middles, strict=True)
    ]


def _fit(matrix: Array, signal: Array) -> Array:
    """Least squares, (channels, 2H+1), by normal equations: over whole revolutions they are near diagonal."""
    return np.asarray(np.linalg.solve(matrix.T @ matrix, matrix.T @ signal).T)


def _scatter(matrix: Array, signal: Array) -> Array:
    """Return the variance of each coefficient, (channels, 2H+1), by what the fit leaves of the samples."""
    left = signal - matrix @ _fit(matrix, signal).T
    noise = (left**2).sum(axis=0) / max(len(left) - matrix.shape[1], 1)
    return np.asarray(np.outer(noise, np.diag(np.linalg.inv(matrix.T @ matrix))))


def _shrunk(variance: Array, freedom: float, prior_freedom: int = 6) -> Array:
    """Draw each order's variance, (channels, 2H+1), towards the typical one of five orders on each side.

    That is their median over that of chi-squared, which is far below its mean where few segments made it.
    """
    from scipy.special import chdtri

    padded = np.pad(variance, ((0, 0), (10, 10)), mode="reflect")
    neighbours = np.median(np.lib.stride_tricks.sliding_window_view(padded, 21, axis=1), axis=2)
    if freedom:
        each = max(freedom, 1.0)  # a single difference has one degree of freedom
        neighbours = neighbours * each / chdtri(each, 0.5)
    return np.asarray((freedom * variance + prior_freedom * neighbours) / (freedom + prior_freedom))
