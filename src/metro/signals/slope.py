"""The slope of a short series whose values are not independent, with its standard deviation."""

from __future__ import annotations

import math

import numpy as np

from metro.units import Array

LEAST_VALUES = 6
MOST_ALIKE = 0.9  # correlation of neighbours; that of a line through so few values is hardly known beyond it


def slope(time: Array, values: Array) -> tuple[Array, Array]:
    """Slope of channels by least squares, and its standard deviation, both (channels,), per unit of time.

    The deviation allows for what neighbours have in common: independent values would be fewer by
    (1 + r) / (1 - r), r the correlation of successive residuals (not less than nothing). Not a number with
    less than six values.

    Parameters
    ----------
    time : (n,). values : (n, channels).
    """
    channels = values.shape[1]
    if len(time) < LEAST_VALUES:
        return np.full(channels, math.nan), np.full(channels, math.nan)
    since = time - time.mean()
    rate = since @ values / (since @ since)
    residual = values - values.mean(axis=0) - since[:, None] * rate
    power = (residual**2).sum(axis=0)
    alike = (residual[1:] * residual[:-1]).sum(axis=0) / np.maximum(power, 1e-300)
    alike = np.clip(alike, 0.0, MOST_ALIKE)
    variance = power / (len(time) - 2) / (since @ since) * (1.0 + alike) / (1.0 - alike)
    return np.asarray(rate), np.sqrt(variance)
