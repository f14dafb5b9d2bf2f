"""Whether samples are evenly spaced, and where they are if not: logs lose samples and their clocks jitter."""

from __future__ import annotations

import numpy as np

from metro.units import Array

# The smoothed levels that take intervals for even which differ by up to this share e from the median are
# wrong by at most e of their own standard deviation, and so is every sum of them: the error is P Dᵀ (δ u) /
# √Q, to first order, where u, the smoothed steps over √Q, has a covariance of at most 1, so that its
# covariance is at most e² P Dᵀ D P / Q = e² (P − P P / R), which is at most e² P, the smoother's own
# covariance. The total error rises by the root of 1 + e²: by half a per cent.
UNEVEN = 0.1


def uneven(place: Array) -> Array | None:
    """Return the intervals (n - 1,) of rising places or times (n,) over their median; None if all are even.

    Even are those that differ from the median by at most a share ``UNEVEN`` of it.
    """
    interval = np.diff(place)
    if not len(interval):
        return None
    interval = interval / np.median(interval)
    return None if np.abs(interval - 1.0).max() <= UNEVEN else interval


def places(count: int, interval: Array | None) -> Array:
    """Return where samples are (count,), from -1 to 1; ``interval`` as of :func:`uneven`."""
    if interval is None:
        return np.linspace(-1.0, 1.0, count)
    place = np.concatenate([[0.0], np.cumsum(interval)])
    return np.asarray(2.0 * place / place[-1] - 1.0)
