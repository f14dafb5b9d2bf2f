"""A slowly wandering level in noise: random-walk Kalman filter and smoother, its drift by maximum likelihood.

x_{k+1} = x_k + w, z_k = x_k + v, per channel ([K] §3.1); R = var v is known, Q = var w comes from the signal.
"""

from __future__ import annotations

import math

import numpy as np

from metro.units import Array

RATIOS = (1e-8, 1e4)


def noise_variance(signal: Array) -> Array:
    """Variance (k,) of the white noise on smooth channels (n, k): a sixth of the second differences'."""
    return np.asarray((np.diff(signal, n=2, axis=0) ** 2).mean(axis=0) / 6.0)


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
    level, variance = signal[0] + 0 * drift, measurement + 0 * drift
    total = np.zeros_like(drift)
    for z in signal[1:]:
        predicted = variance + drift
        spread = predicted + measurement
        innovation = z - level
        total -= 0.5 * (np.log(2 * np.pi * spread) + innovation**2 / spread)
        level = level + predicted / spread * innovation
        variance = predicted * measurement / spread
    return total


def likeliest_drift(signal: Array, measurement: Array) -> Array:
    """Q (k,) that makes the channels (n, k) likeliest, given R (k,): searched over Q/R from 1e-8 to 1e4."""
    lowest, highest = math.log(RATIOS[0]), math.log(RATIOS[1])
    grid = np.tile(np.linspace(lowest, highest, 56)[:, None], (1, signal.shape[1]))
    half = grid[1] - grid[0]
    for _ in range(2):
        best = np.argmax(log_likelihood(signal, measurement, np.exp(grid) * measurement), axis=0)
        centre = np.take_along_axis(grid, best[None], axis=0)
        grid = centre + np.linspace(-half, half, 26)
        half = half / 12.5
    best = np.argmax(log_likelihood(signal, measurement, np.exp(grid) * measurement), axis=0)
    return np.asarray(np.exp(np.take_along_axis(grid, best[None], axis=0)[0]) * measurement)


def smooth(signal: Array, measurement: Array, drift: Array) -> tuple[Array, Array]:
    """Level (n, k) of each channel and its variance (n, k), from all samples (filter, then RTS smoother)."""
    level, variance = np.empty_like(signal), np.empty_like(signal)
    for channel, (r, q) in enumerate(zip(measurement, drift, strict=True)):
        level[:, channel], variance[:, channel] = _smooth_one(signal[:, channel], float(r), float(q))
    return level, variance


def _smooth_one(signal: Array, r: float, q: float) -> tuple[Array, Array]:
    from filterpy.kalman import KalmanFilter

    walk = KalmanFilter(dim_x=1, dim_z=1)
    walk.F = walk.H = np.eye(1)
    walk.R, walk.Q = np.array([[r]]), np.array([[q]])
    walk.x, walk.P = np.array([[signal[0]]]), np.array([[r]])
    # the first sample is the start itself: filterpy predicts before each update
    mean, covariance, _, _ = walk.batch_filter(signal[1:])
    mean = np.concatenate([[[[signal[0]]]], mean])
    covariance = np.concatenate([[[[r]]], covariance])
    mean, covariance, _, _ = walk.rts_smoother(mean, covariance)
    return mean[:, 0, 0], covariance[:, 0, 0]
