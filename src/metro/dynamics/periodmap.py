"""The map of one period, step by step, and its largest multiplier without the matrix: Arnoldi's method.

``z[i+1] = P[i] z[i] + sum_q D[i, q] y[i + 1 - lag_q]``, with the displacements ``y = C z`` of earlier steps.
Only these two are remembered, however many modes there are. Speeds are stacked: a step of all is one product.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from metro.units import Array, ComplexArray

# Multipliers of almost one modulus take up to some hundred vectors. The eigenvalues are looked at after every
# eighth one, later after a tenth more, so that looking costs less than the vectors.
_MOST, _CHECK_EVERY, _RESIDUAL = 400, 8, 1e-10
_SECANTS = 12
_TOGETHER = 60_000  # steps of all rows of a stack: four hundred vectors of as many numbers take 0.2 GB


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
    """(k,) largest modulus of the multipliers, to ten digits; NaN where the method does not converge."""
    start = np.random.default_rng(0).normal(size=(len(period_map.state), period_map.size))
    most = min(_MOST, period_map.size)
    basis = np.empty((len(start), 1, period_map.size))
    basis[:, 0] = start / np.linalg.norm(start, axis=1, keepdims=True)
    hessenberg = np.zeros((len(start), most + 1, most))
    radius, residual = np.full(len(start), np.nan), np.full(len(start), np.inf)
    look = _CHECK_EVERY
    for j in range(most):
        vector, known = period_map.apply(basis[:, j]), basis[:, : j + 1]
        for _ in range(2):  # once leaves rounding errors of the parts taken away
            share = known @ vector[:, :, None]
            vector -= (share.transpose(0, 2, 1) @ known)[:, 0]
            hessenberg[:, : j + 1, j] += share[:, :, 0]
        remainder = np.linalg.norm(vector, axis=1)
        hessenberg[:, j + 1, j] = remainder
        if j + 1 == look or j + 1 == most:
            radius, residual = _largest(hessenberg[:, : j + 1, : j + 1], remainder)
            if np.all(residual < _RESIDUAL * radius):
                break
            look += max(_CHECK_EVERY, look // 10)
        if j + 1 == basis.shape[1]:  # room for as many again
            basis = np.concatenate([basis, np.empty_like(basis)], axis=1)
        basis[:, j + 1] = vector / np.maximum(remainder, 1e-300)[:, None]
    return np.where(residual < _RESIDUAL * radius, radius, np.nan)


def _largest(hessenberg: Array, remainder: Array) -> tuple[Array, Array]:
    values: ComplexArray
    vectors: ComplexArray
    values, vectors = np.linalg.eig(hessenberg)
    best = np.abs(values).argmax(axis=1)
    row = np.arange(len(best))
    return np.abs(values[row, best]), remainder * np.abs(vectors[row, -1, best])


def stacks(steps: np.ndarray, ratio: float) -> list[np.ndarray]:
    """Return stacks of rows that need about as many ``steps`` (k,), within a ``ratio``, and fit in memory."""
    made: list[list[int]] = []
    for row in np.argsort(steps, kind="stable"):
        last = made[-1] if made else []
        if not last or steps[row] > ratio * steps[last[0]] or (len(last) + 1) * steps[row] > _TOGETHER:
            made.append([])
        made[-1].append(int(row))
    return [np.array(stack) for stack in made]


def unit_radius(radius: Callable[[Array], Array], start: Array) -> Array:
    """Return the depths (k,) near ``start`` where ``radius`` is 1; NaN where none is found, or it is unknown.

    By secants over the logarithm of the depth.
    """
    before, now = np.log(start), np.log(start) + 0.02
    value_before, value = np.log(radius(np.exp(before))), np.log(radius(np.exp(now)))
    for _ in range(_SECANTS):
        rise = np.where(value == value_before, np.inf, value - value_before)
        step = np.clip(-value * (now - before) / rise, -0.2, 0.2)
        before, value_before, now = now, value, now + step
        if not np.any(np.abs(step) >= 1e-7):  # what is unknown stays unknown
            break
        value = np.log(radius(np.exp(now)))
    return np.where(np.abs(value) < 1e-6, np.exp(now), np.nan)
