"""The map of one period, step by step, and its largest multiplier without the matrix: Arnoldi's method.

``z[i+1] = P[i] z[i] + sum_q D[i, q] y[i + 1 - lag_q]``, with the displacements ``y = C z`` of earlier steps.
Only these two are remembered, however many modes there are. Speeds are stacked: a step of all is one product.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from metro.units import Array, ComplexArray

_MOST, _CHECK_EVERY, _RESIDUAL = 80, 8, 1e-10
_SECANTS = 12


@dataclass(frozen=True)
class PeriodMap:
    """Steps of one period at k speeds.

    Attributes
    ----------
    state : (k, s, n, n) P.
    delayed : (k, s, q, n, d) D.
    lags : (q,) whole steps, at least 1.
    out : (d, n) C.
    """

    state: Array
    delayed: Array
    lags: np.ndarray
    out: Array

    @property
    def size(self) -> int:
        """Length of what is remembered: the state, and ``lags.max()`` displacements, newest first."""
        return int(self.state.shape[2] + len(self.out) * self.lags.max())

    def apply(self, start: Array) -> Array:
        """Carry (k, size) over one period."""
        k, steps, n, _ = self.state.shape
        oldest, d = int(self.lags.max()), len(self.out)
        y = np.empty((oldest + steps, k, d, 1))
        y[:oldest] = start[:, n:].reshape(k, oldest, d, 1).transpose(1, 0, 2, 3)[::-1]
        z = start[:, :n, None]
        for i in range(steps):
            z = self.state[:, i] @ z
            for q, lag in enumerate(self.lags):
                z += self.delayed[:, i, q] @ y[oldest + i - lag]
            y[oldest + i] = self.out @ z
        history = y[: -oldest - 1 : -1].transpose(1, 0, 2, 3).reshape(k, -1)
        return np.concatenate([z[:, :, 0], history], axis=1)


def spectral_radius(period_map: PeriodMap) -> Array:
    """(k,) largest modulus of the multipliers, to ten digits.

    Raises
    ------
    ArithmeticError
        When Arnoldi's method has not converged.
    """
    start = np.random.default_rng(0).normal(size=(len(period_map.state), period_map.size))
    basis = [start / np.linalg.norm(start, axis=1, keepdims=True)]
    most = min(_MOST, period_map.size)
    hessenberg = np.zeros((len(start), most + 1, most))
    for j in range(most):
        vector = period_map.apply(basis[j])
        known = np.stack(basis, axis=1)
        for _ in range(2):  # once leaves rounding errors of the parts taken away
            share = known @ vector[:, :, None]
            vector -= (share.transpose(0, 2, 1) @ known)[:, 0]
            hessenberg[:, : j + 1, j] += share[:, :, 0]
        remainder = np.linalg.norm(vector, axis=1)
        hessenberg[:, j + 1, j] = remainder
        basis.append(vector / np.maximum(remainder, 1e-300)[:, None])
        if (j + 1) % _CHECK_EVERY == 0 or j + 1 == most:
            radius, residual = _largest(hessenberg[:, : j + 1, : j + 1], remainder)
            if np.all(residual < _RESIDUAL * radius):
                return radius
    raise ArithmeticError(f"Arnoldi's method: residual {residual.max():.1e} after {most} steps")


def _largest(hessenberg: Array, remainder: Array) -> tuple[Array, Array]:
    values: ComplexArray
    vectors: ComplexArray
    values, vectors = np.linalg.eig(hessenberg)
    best = np.abs(values).argmax(axis=1)
    row = np.arange(len(best))
    return np.abs(values[row, best]), remainder * np.abs(vectors[row, -1, best])


def unit_radius(radius: Callable[[Array], Array], start: Array) -> Array:
    """Return the depths (k,) near ``start`` where ``radius`` is 1; NaN where none is found.

    By secants over the logarithm of the depth.
    """
    before, now = np.log(start), np.log(start) + 0.02
    value_before, value = np.log(radius(np.exp(before))), np.log(radius(np.exp(now)))
    for _ in range(_SECANTS):
        rise = np.where(value == value_before, np.inf, value - value_before)
        step = np.clip(-value * (now - before) / rise, -0.2, 0.2)
        before, value_before, now = now, value, now + step
        if np.all(np.abs(step) < 1e-7):
            break
        value = np.log(radius(np.exp(now)))
    return np.where(np.abs(value) < 1e-6, np.exp(now), np.nan)
