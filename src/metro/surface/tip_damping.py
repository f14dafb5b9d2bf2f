"""Proportional damping C = a0 M + a1 K: from the damping ratios of modes, or from printed matrices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array


@dataclass(frozen=True, eq=False)
class Rayleigh:
    """Coefficients a0 (1/s) and a1 (s) as ``values`` (2,), with their ``covariance`` (2, 2).

    ``misfit``: rms of what the ratios miss over their errors, NaN where two modes leave nothing over.
    """

    values: Array
    covariance: Array
    misfit: float

    def ratio(self, frequency: Array) -> Array:
        """Damping ratio at undamped ``frequency`` (rad/s): ζ = a0/2ω + a1 ω/2."""
        return np.asarray(damping_rows(frequency) @ self.values)

    def shifted(self, sd: Array) -> Rayleigh:
        """Return these coefficients moved by ``sd`` (2,)."""
        return Rayleigh(self.values + sd, self.covariance, self.misfit)


def damping_rows(frequency: Array) -> Array:
    """Rows (…, 2) of ζ in a0 and a1 at ``frequency``, rad/s."""
    return np.stack([0.5 / frequency, 0.5 * frequency], axis=-1)


def fit_rayleigh(frequency: Array, ratio: Array, sd: Array) -> Rayleigh:
    """Weighted least squares of damping ratios (n,), each known to ``sd``, at ``frequency`` (n,) rad/s.

    Where more than two modes miss a common a0 and a1 by more than their errors, these grow in proportion.

    Raises
    ------
    ValueError
        If fewer than two different frequencies are given.
    """
    if len(np.unique(frequency)) < 2:
        raise ValueError("a0 and a1 take the damping of two modes of different frequency")
    rows = damping_rows(frequency) / sd[:, None]
    size = np.linalg.norm(rows, axis=0)
    inverse = np.linalg.pinv(rows / size) / size[:, None]
    values = inverse @ (ratio / sd)
    dof = len(ratio) - 2
    rest = ratio / sd - rows @ values
    misfit = float(np.sqrt(rest @ rest / dof)) if dof > 0 else float("nan")
    return Rayleigh(values, inverse @ inverse.T * max(1.0, np.nan_to_num(misfit)) ** 2, misfit)


def rayleigh_of_matrices(mass: Array, stiffness: Array, damping: Array) -> tuple[Array, float]:
    """Return a0 and a1 (2,) by least squares over the entries (3, 3), and the share of C that they miss."""
    rows = np.column_stack([mass.ravel(), stiffness.ravel()])
    size = np.linalg.norm(rows, axis=0)
    values = np.linalg.lstsq(rows / size, damping.ravel(), rcond=None)[0] / size
    rest = damping.ravel() - rows @ values
    return values, float(np.linalg.norm(rest) / np.linalg.norm(damping))
