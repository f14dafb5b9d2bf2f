"""A slowly wandering level in noise: random-walk Kalman filter and smoother, its drift by maximum likelihood.

x_{k+1} = x_k + w, z_k = x_k + v, per channel ([K] §3.1); R = var v is known, Q = var w comes from the signal.
Cosines over the record are the eigenvectors of the walk's steps, D Dᵀ with l_j = 2 − 2 cos(π j / n), so that
over a whole record the likelihood (parts j are independent, of variance R + Q / l_j), the smoothed level
(part j times Q / (Q + R l_j)) and its covariance are closed forms: no loop over time. They hold for
samples at even intervals; :mod:`metro.signals.kalman_uneven` has the others.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from itertools import repeat

import numpy as np

from metro.signals.intervals import places
from metro.signals.quality import GAP
from metro.units import Array

RATIOS = (1e-8, 1e4)
LAGS = 10  # of the innovations' autocorrelation


def noise_variance(signal: Array, interval: Array | None = None) -> Array:
    """Variance (k,) of the white noise on smooth channels (n, k): a sixth of the second differences'.

    At uneven intervals (:func:`metro.signals.intervals.uneven`) the differences are those from the straight
    line between the two neighbours, each over its own gain, and those beside a gap are left out: the channel
    may do anything there.
    """
    if interval is None:
        return np.asarray((np.diff(signal, n=2, axis=0) ** 2).mean(axis=0) / 6.0)
    before, after = interval[:-1], interval[1:]
    share = (before / (before + after))[:, None]
    from_line = signal[1:-1] - (1.0 - share) * signal[:-2] - share * signal[2:]
    near = np.maximum(before, after) <= GAP
    return np.asarray((from_line**2 / (1.0 + share**2 + (1.0 - share) ** 2))[near].mean(axis=0))


def long_run_variance(
    signal: Array, steps: Array | None = None, longest: int = 100, interval: Array | None = None
) -> Array:
    """Return n times the variance (k,) of a mean of n samples of coloured noise on smooth channels (m, k).

    An autoregression of first order by Whittle's likelihood over the periods up to ``longest`` samples: what
    is slower is the channel itself (friction and gravity along a path), and so is what follows ``steps`` (m,
    k) (friction that turns round). For white noise it is the variance. ``interval`` (m - 1,) of samples that
    are not even: the channel is slow over time, its noise goes on from sample to sample.
    """
    from scipy.fft import dct

    count = len(signal)
    place = places(count, interval)
    slow = np.vander(place, min(4, count))
    residual = np.empty_like(signal, dtype=float)
    for k, channel in enumerate(signal.T):
        known = slow if steps is None else np.column_stack([slow, steps[:, k]])
        residual[:, k] = channel - known @ np.linalg.lstsq(known, channel, rcond=1e-9)[0]
    first = max(1, 2 * count // longest)
    power = dct(residual, axis=0, norm="ortho")[first:] ** 2
    cosine = np.cos(np.pi * np.arange(first, count) / count)
    persistence = np.linspace(-0.5, 0.98, 149)[:, None]
    # the band's mean of 1 − 2 ρ cos + ρ² times the power, and of its logarithm (smooth: on some of the band)
    driving = (1.0 + persistence**2) * power.mean(axis=0) - 2.0 * persistence * (cosine @ power / len(power))
    shape = 1.0 - 2.0 * persistence * cosine[:: max(1, len(cosine) // 1000)] + persistence**2
    likelihood = np.log(shape).mean(axis=1)[:, None] - np.log(np.maximum(driving, 1e-300))
    best = np.argmax(likelihood, axis=0)
    return np.asarray(driving[best, range(signal.shape[1])] / (1.0 - persistence[best, 0]) ** 2)


def log_likelihood(signal: Array, measurement: Array, drift: Array) -> Array:
    """Log-likelihood of each channel given its first sample, for every pair of variances.

    Parameters
    ----------
    signal : (n, k). measurement : (k,) R. drift : (g, k) values of Q to judge.

    Returns
    -------
    Array
        (g, k).
    """
    step, part = _parts(signal)
    energy = step[1:, None] * part[1:] ** 2
    slow = step[1:, None] * measurement
    constant = 0.5 * (len(signal) - 1) * math.log(2 * math.pi)
    likelihood = np.empty(drift.shape)
    for row, q in enumerate(drift):  # one at a time: all at once would not fit the cache
        spread = slow + q
        likelihood[row] = -0.5 * (np.log(spread) + energy / spread).sum(axis=0) - constant
    return likelihood


def likeliest_drift(
    signal: Array, measurement: Array, likelihood: Callable[[Array, Array, Array], Array] = log_likelihood
) -> Array:
    """Q (k,) that makes the channels (n, k) likeliest, given R (k,): searched over Q/R from 1e-8 to 1e4."""
    lowest, highest = math.log(RATIOS[0]), math.log(RATIOS[1])
    grid = np.tile(np.linspace(lowest, highest, 29)[:, None], (1, signal.shape[1]))
    half = grid[1] - grid[0]
    for _ in range(3):
        best = np.argmax(likelihood(signal, measurement, np.exp(grid) * measurement), axis=0)
        centre = np.take_along_axis(grid, best[None], axis=0)
        grid = centre + np.linspace(-half, half, 15)
        half = half / 7.0
    best = np.argmax(likelihood(signal, measurement, np.exp(grid) * measurement), axis=0)
    return np.asarray(np.exp(np.take_along_axis(grid, best[None], axis=0)[0]) * measurement)


def smooth(signal: Array, measurement: Array, drift: Array) -> tuple[Array, Array]:
    """Level (n, k) of each channel and its variance (n, k), from all samples: those of an RTS smoother."""
    from scipy.fft import idct

    step, part = _parts(signal)
    passed = drift / (drift + step[:, None] * measurement)
    level: Array = idct(part * passed, axis=0, norm="ortho")
    return level, _variance(len(signal), measurement, drift)


def combined_covariance(weights: Array, measurement: Array, drift: Array) -> Array:
    """Covariance (c, c) of sums over samples and channels, Σ w x, of smoothed levels.

    Neighbours share most of their error: over a stretch it is not that of independent samples, nor that of
    one.

    Parameters
    ----------
    weights : (c, n, k). measurement, drift : (k,) R and Q.
    """
    from scipy.fft import dct

    part = dct(weights, axis=1, norm="ortho")
    spread = measurement * drift / (drift + _steps(weights.shape[1])[:, None] * measurement)
    return np.asarray(np.einsum("ank,nk,bnk->ab", part, spread, part, optimize=True))


def innovations(signal: Array, measurement: Array, drift: Array) -> Array:
    """Return what each sample brings beyond the filter's forecast, (n - 1, k), in standard deviations."""
    return standardised(signal, measurement, repeat(drift))


def standardised(signal: Array, measurement: Array, drift: Iterable[Array]) -> Array:
    """Return the innovations (n - 1, k) of :func:`forecasts` over their standard deviations."""
    scaled = np.empty((len(signal) - 1, signal.shape[1]))
    for row, (innovation, spread) in enumerate(forecasts(signal, measurement, drift)):
        scaled[row] = innovation / np.sqrt(spread)
    return scaled


def forecasts(signal: Array, measurement: Array, drift: Iterable[Array]) -> Iterator[tuple[Array, Array]]:
    """Yield each sample's innovation against the filter's forecast, and its variance, from the second on.

    Parameters
    ----------
    signal : (n, k). measurement : (k,) R. drift : for each step Q (k,), or (g, k) of several trials at once.
    """
    level, variance = signal[0], measurement
    for z, wander in zip(signal[1:], drift, strict=False):
        predicted = variance + wander
        spread = predicted + measurement
        innovation = z - level
        gain = predicted / spread
        yield innovation, spread
        level = level + gain * innovation
        variance = gain * measurement


def whiteness(values: Array, fitted: Array | float = 0.0, lags: int = LAGS) -> Array:
    """Probability (k,) of autocorrelations at least as large in white noise of mean zero (Li & McLeod 1981).

    Their statistic n Σ r² + m (m + 1) / 2n has the variance of χ² in short records too, where that of Ljung &
    Box has more; with n + 2 in front its mean is exactly m, as E r² = (n − h) / n (n + 2).

    Parameters
    ----------
    values : (n, k) innovations. fitted : degrees of freedom that the fit of the channel took, (k,) or one.
    lags : how many, at most a fifth of the samples.

    Returns
    -------
    Array
        NaN for records of fewer than three samples, of which nothing can be said.
    """
    from scipy.stats import chi2

    count = len(values)
    if count < 3:
        return np.full(values.shape[1], np.nan)
    lags = max(2, min(lags, count // 5))
    power = (values**2).sum(axis=0)
    r = np.stack([(values[h:] * values[:-h]).sum(axis=0) / power for h in range(1, lags + 1)])
    statistic = (count + 2) * (r**2).sum(axis=0) + lags * (lags + 1) / (2.0 * count)
    return np.asarray(chi2.sf(statistic, lags - fitted))


def freedom_of_drift(measurement: Array, drift: Array, lags: int = LAGS) -> Array:
    """Degrees of freedom (k,) that fitting the drift takes from the autocorrelations of the innovations.

    The steps of the channel are an MA(1) of coefficient −λ and variance R/λ, with Q/R = (1 − λ)²/λ. Where λ
    is wrong by dλ, autocorrelation h is by λ^(h − 1) dλ; the likelihood knows λ from the autocorrelations,
    1/(1 − λ²), and, as R is known, from the variance, 1/2λ². So the sum of squares of m autocorrelations
    loses 2λ²/(1 + λ²) · (1 − λ^2m): less than one, as a drift that would whiten them is not the likeliest.
    """
    square = np.exp(-4.0 * np.arcsinh(0.5 * np.sqrt(drift / measurement)))
    return np.asarray(2.0 * square / (1.0 + square) * (1.0 - square**lags))


def _steps(count: int) -> Array:
    """Eigenvalues l (n,) of the walk's squared steps, 2 − 2 cos: without its cancellation at small angles."""
    return np.asarray(4.0 * np.sin(0.5 * np.pi * np.arange(count) / count) ** 2)


def _parts(signal: Array) -> tuple[Array, Array]:
    from scipy.fft import dct

    return _steps(len(signal)), np.asarray(dct(signal, axis=0, norm="ortho"))


def _variance(count: int, measurement: Array, drift: Array) -> Array:
    """Diagonal (n, k) of the smoothed level's covariance, the inverse of 1 / R + D Dᵀ / Q.

    Q / (2 sinh θ) · (coth nθ + cosh((n + 1 − 2k) θ) / sinh nθ) with 2 cosh θ = 2 + Q / R, sample k from 1.
    """
    angle = 2.0 * np.arcsinh(0.5 * np.sqrt(drift / measurement))
    off = np.abs(count + 1.0 - 2.0 * np.arange(1, count + 1))[:, None]
    end = -np.expm1(-2.0 * count * angle)
    rise = np.exp((off - count) * angle) * (1.0 + np.exp(-2.0 * off * angle)) / end
    return np.asarray(drift / (2.0 * np.sinh(angle)) * ((2.0 - end) / end + rise))
