"""Symmetric 3×3 matrices at points of a face (mass, compliance), as polynomials over it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.surface.tip_stiffness import TERMS, Basis, basis_over
from metro.units import Array


@dataclass(frozen=True, eq=False)
class MatrixField:
    """Matrices over (x, y): ``terms`` (terms of the basis, 9).

    ``error``: relative rms error (Frobenius) of predicting each point from all others; NaN where there are
    too few points to compare.
    """

    basis: Basis
    terms: Array
    error: float

    def __call__(self, x: Array, y: Array) -> Array:
        """Matrices (n, 3, 3) at ``x``, ``y`` (n,) m."""
        return np.asarray((self.basis(x, y) @ self.terms).reshape(-1, 3, 3))


def field_in(basis: Basis, x: Array, y: Array, matrices: Array) -> MatrixField:
    """Return the field in the terms of ``basis`` through ``matrices`` (n, 3, 3) at ``x``, ``y`` (n,)."""
    flat = matrices.reshape(len(matrices), 9)
    return MatrixField(basis, np.linalg.pinv(basis(x, y)) @ flat, left_out(basis, x, y, flat))


def choose_field(x: Array, y: Array, matrices: Array) -> MatrixField:
    """Return the field in the polynomial that best predicts points left out.

    A higher degree must be better by 5 %: a tie goes to the simpler field. One point gives a constant.
    """
    best = field_in(basis_over(x, y, TERMS[0]), x, y, matrices)
    for terms in TERMS[1:]:
        other = field_in(basis_over(x, y, terms), x, y, matrices)
        if other.error < 0.95 * best.error:
            best = other
    return best


def left_out(basis: Basis, x: Array, y: Array, flat: Array) -> float:
    """Relative rms error of predicting each row of ``flat`` (n, 9) from all others; NaN if one cannot be."""
    values, errors = basis(x, y), []
    for point in range(len(flat)):
        kept = np.arange(len(flat)) != point
        if np.linalg.matrix_rank(values[kept]) < basis.terms:
            return float("nan")
        errors.append(flat[point] - values[point] @ np.linalg.pinv(values[kept]) @ flat[kept])
    return float(np.linalg.norm(errors) / np.linalg.norm(flat))


def least_eigenvalue(matrices: Array) -> Array:
    """Least eigenvalue of symmetric matrices (n, 3, 3) over the greatest, (n,): not above 0, not definite."""
    values = np.linalg.eigvalsh(matrices)
    return np.asarray(values[:, 0] / np.abs(values).max(axis=1))
