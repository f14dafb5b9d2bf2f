"""Linear least squares to the last digit: columns of one length, Householder's QR, refined residuals.

The residual and the solution are refined together, their sums in extended precision (Björck, BIT 7 (1967)
257): then it is the data and not the solver that says how many digits the solution has.
"""

from __future__ import annotations

import numpy as np

from metro.units import Array

REFINEMENTS = 6


def least_squares(columns: Array, target: Array) -> Array:
    """Return the x (p,) that leaves the least of ``target`` (n,) - ``columns`` (n, p) x.

    Where the columns depend on each other to rounding, the x of the shortest scaled length.
    """
    size = np.linalg.norm(columns, axis=0)  # of units as different as N/mm2 and N/mm
    scale = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
    scaled = columns * scale
    q, r = np.linalg.qr(scaled)
    if not r.size:  # a printed table has no coefficients to fit
        return np.zeros(len(size))
    if len(r) < r.shape[1] or np.linalg.cond(r) * np.finfo(float).eps * len(target) > 1.0:
        return np.asarray(scale * np.linalg.lstsq(scaled, target, rcond=None)[0])
    back = np.linalg.inv(r)
    exact, x = columns.astype(np.longdouble), np.zeros(len(size), np.longdouble)
    residual = np.zeros(len(target), np.longdouble)
    for _ in range(REFINEMENTS):
        missing = np.asarray(target - residual - exact @ x, dtype=float)
        slant = np.asarray(-(exact.T @ residual) * scale, dtype=float)
        turned, leant = q.T @ missing, back.T @ slant
        x = x + scale * (back @ (turned - leant))
        residual = residual + (missing - q @ (turned - leant))
    return np.asarray(x, dtype=float)
