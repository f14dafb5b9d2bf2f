"""The random walk of :mod:`metro.signals.kalman` at uneven intervals: gaps and jitter of a log.

Between two samples the level wanders with the variance Q times their interval, in units of the median
interval. The closed forms of the even walk do not hold then: filterpy's Kalman filter and its
Rauch-Tung-Striebel smoother take a variance of their own for each step.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from metro.signals import kalman
from metro.units import Array


def log_likelihood(signal: Array, measurement: Array, drift: Array, interval: Array) -> Array:
    """Log-likelihood (g, k) of each channel given its first sample, for every value (g, k) of Q.

    All trials pass through the filter together: filterpy takes them one by one.
    """
    variances = (ratio * drift for ratio in interval)
    total = np.full(drift.shape, -0.5 * (len(signal) - 1) * math.log(2 * math.pi))
    for innovation, spread in kalman.forecasts(signal, measurement, variances):
        total -= 0.5 * (np.log(spread) + innovation**2 / spread)
    return total


def likeliest_drift(signal: Array, measurement: Array, interval: Array) -> Array:
    """Q (k,) per median interval that makes the channels (n, k) likeliest, given R (k,)."""
    return kalman.likeliest_drift(signal, measurement, partial(log_likelihood, interval=interval))


def smooth(signal: Array, measurement: Array, drift: Array, interval: Array) -> tuple[Array, Array]:
    """Level (n, k) of each channel and its variance (n, k), from all samples, by filterpy's smoother."""
    from filterpy.kalman import KalmanFilter

    channels = signal.shape[1]
    walk = KalmanFilter(dim_x=channels, dim_z=channels)
    walk.F = walk.H = np.eye(channels)
    walk.R = walk.P = np.diag(measurement)
    walk.x = signal[0]
    # the first level is known by its own sample alone: the filter begins behind it
    wandered = [np.diag(ratio * drift) for ratio in interval]
    mean, covariance, _, _ = walk.batch_filter(signal[1:], Qs=wandered)
    mean = np.concatenate([signal[:1], mean])
    covariance = np.concatenate([np.diag(measurement)[None], covariance])
    level, covariance, _, _ = walk.rts_smoother(mean, covariance, Qs=[wandered[0], *wandered])
    return np.asarray(level), np.einsum("nkk->nk", covariance).copy()


def combined_covariance(weights: Array, measurement: Array, drift: Array, interval: Array) -> Array:
    """Covariance (c, c) of sums over samples and channels, Σ w x, of smoothed levels.

    Parameters
    ----------
    weights : (c, n, k). measurement, drift : (k,) R and Q.
    interval : (n - 1,) of :func:`metro.signals.intervals.uneven`.
    """
    from scipy.linalg import solveh_banded

    total = np.zeros((len(weights), len(weights)))
    for channel, noise, wander in zip(np.moveaxis(weights, 2, 0), measurement, drift, strict=True):
        information = 1.0 / (wander * interval)
        band = np.zeros((2, len(interval) + 1))
        band[0, 1:] = -information
        band[1] = 1.0 / noise
        band[1, 1:] += information
        band[1, :-1] += information
        total += channel @ solveh_banded(band, channel.T)
    return total


def innovations(signal: Array, measurement: Array, drift: Array, interval: Array) -> Array:
    """Return what each sample brings beyond the filter's forecast, (n - 1, k), in standard deviations."""
    return kalman.standardised(signal, measurement, (ratio * drift for ratio in interval))
