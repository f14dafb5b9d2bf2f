"""A simulated face beside the measured one: flatness indices at path points, D_r and similarity.

After Iglesias et al. 2025. Their text defines D_r = (d_m − d_s)/d_m (equation 8), their tables divide by d_s:
both are given. The similarity that they state for a case (97 % for X_m 0.471 simulated, 0.458 measured) is
1 − |D_r| as the tables have it.
"""

from __future__ import annotations

import numpy as np

from metro.surface.indices import log_mean_floor
from metro.units import Array

INDICES = ("xm", "xa", "xg")


def about_plane(x: Array, y: Array, heights: Array) -> Array:
    """Return ``heights`` (…, n) less their least-squares plane over ``x``, ``y`` (n,), along z.

    Over a face within a degree of level, this is the orthogonal deviation to 2 · 10⁻⁴ of itself.
    """
    across = np.column_stack([np.ones(len(x)), x - x.mean(), y - y.mean()])
    basis = np.linalg.qr(across / np.linalg.norm(across, axis=0))[0]
    return np.asarray(heights - heights @ basis @ basis.T)


def indices_of(deviations: Array, step: float = 0.0) -> Array:
    """X_m, X_a, X_g of ``deviations`` (…, n), on a last axis of three; below ``step``/2, |d| is not known."""
    size = np.abs(deviations)
    floor = max(log_mean_floor(step), np.finfo(float).tiny)
    floored = np.where(size < max(step / 2, floor), floor, size)
    return np.stack(
        [np.ptp(deviations, axis=-1), size.mean(axis=-1), np.exp(np.log(floored).mean(axis=-1))], axis=-1
    )


def relative_deviation(measured: Array, simulated: Array) -> tuple[Array, Array]:
    """D_r by both conventions: of the measured value (equation 8), and of the simulated one (tables 6 and 7).

    NaN where the divisor is zero.
    """
    apart = np.asarray(measured, dtype=float) - simulated
    return _over(apart, measured), _over(apart, simulated)


def _over(apart: Array, by: Array) -> Array:
    by = np.broadcast_to(by, apart.shape)
    return np.asarray(np.divide(apart, by, out=np.full(apart.shape, np.nan), where=by != 0))


def similarity(measured: Array, simulated: Array) -> Array:
    """1 − |D_r|, D_r as tables 6 and 7 have it; below zero where one is more than twice the other."""
    return np.asarray(1 - np.abs(relative_deviation(measured, simulated)[1]))
