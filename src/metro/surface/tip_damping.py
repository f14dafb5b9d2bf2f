"""Proportional damping of the tip: C = a0 M + a1 K from damping ratios of modes, or from printed matrices.

Where no mode was measured, all share one ratio, of which it is only known what arms have.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from metro.units import Array

NODES = 5  # of Gauss's rule


@dataclass(frozen=True, eq=False)
class Rayleigh:
    """Coefficients a0 (1/s) and a1 (s) as ``values`` (2,), with their ``covariance`` (2, 2).

    ``misfit``: rms of what the ratios miss over their errors, NaN where two modes leave nothing over.
    """

    values: Array
    covariance: Array
    misfit: float

    def ratio(self, frequency: Array) -> Array:
        """Damping ratio at undamped ``frequency`` (rad/s): ζ = a0/2ω + a1 ω/2, and never below zero.

        A structure feeds no energy into its own vibration. Coefficients within the errors of a hammer test
        may say so of a frequency beside the measured ones; the tip would then ring up without bounds.
        """
        return np.maximum(damping_rows(frequency) @ self.values, 0.0)

    def shifted(self, sd: Array) -> Rayleigh:
        """Return these coefficients moved by ``sd`` (2,)."""
        return Rayleigh(self.values + sd, self.covariance, self.misfit)

    def doubts(self) -> list[tuple[float, Rayleigh]]:
        """Return what it may be instead, each with the weight of the difference that this makes.

        The second moment of whatever follows from the damping, about that of the damping as it is, is the sum
        of the squares of the weighted differences.
        """
        size, directions = np.linalg.eigh(self.covariance)
        moves = (directions * np.sqrt(np.maximum(size, 0.0))).T
        return [(1.0, self.shifted(move)) for move in moves]


@dataclass(frozen=True)
class SharedRatio:
    """One damping ratio ``value`` of all modes; its logarithm is known to ``sd``.

    The matrices that are printed for a milling arm give its two lowest modes 5 % (Iglesias et al. 2025,
    section 3.1); another arm is taken to have as much, within a factor of two in two of three cases.
    """

    value: float = 0.05
    sd: float = math.log(2.0)

    def ratio(self, frequency: Array) -> Array:
        """Damping ratio at undamped ``frequency`` (rad/s), whatever it is."""
        return np.full(frequency.shape, self.value)

    def doubts(self) -> list[tuple[float, SharedRatio]]:
        """Return what it may be instead, as :meth:`Rayleigh.doubts` does: by Gauss's rule for a normal."""
        place, weight = np.polynomial.hermite_e.hermegauss(NODES)
        share = np.sqrt(weight / weight.sum())
        return [
            (float(part), SharedRatio(self.value * math.exp(at * self.sd), self.sd))
            for at, part in zip(place, share, strict=True)
            if abs(at) > 1e-9
        ]


@dataclass(frozen=True, eq=False)
class Raised:
    """Another ``damping`` whose ratios are higher by ``more``, as friction makes them."""

    damping: Damping
    more: float

    def ratio(self, frequency: Array) -> Array:
        """Damping ratio at undamped ``frequency``, rad/s."""
        return self.damping.ratio(frequency) + self.more

    def doubts(self) -> list[tuple[float, Raised]]:
        """Return what it may be instead, as that of the other damping."""
        return [(weight, Raised(other, self.more)) for weight, other in self.damping.doubts()]


Damping = Rayleigh | SharedRatio | Raised


def damping_rows(frequency: Array) -> Array:
    """Rows (…, 2) of ζ in a0 and a1 at ``frequency``, rad/s."""
    return np.stack([0.5 / frequency, 0.5 * frequency], axis=-1)


def fit_rayleigh(frequency: Array, ratio: Array, sd: Array) -> Rayleigh:
    """Weighted least squares of damping ratios (n,), each known to ``sd``, at ``frequency`` (n,) rad/s.

    Neither coefficient is negative: else modes that are close to each other would leave one at a lower
    frequency, such as that of a softer arm, without any damping. Where the modes miss a common a0 and a1 by
    more than their errors, these grow in proportion. Where they do so, or do not determine both, the share of
    the damping that goes with the mass is taken as anything from none to all: at their mean frequency
    a0/2ω − a1 ω/2 is then zero to the mean ratio over √3.
    """
    from scipy.optimize import nnls

    def fitted(rows: Array, right: Array) -> tuple[Array, Array]:
        size = np.linalg.norm(rows, axis=0)
        inverse = np.linalg.pinv(rows / size) / size[:, None]
        return nnls(rows / size, right)[0] / size, inverse @ inverse.T

    rows, right = damping_rows(frequency) / sd[:, None], ratio / sd
    several = len(np.unique(frequency)) > 1
    values, covariance = fitted(rows, right)
    residual, dof = right - rows @ values, len(ratio) - 2
    misfit = float(np.sqrt(residual @ residual / dof)) if dof > 0 else float("nan")
    if several and (values > 0.0).all() and not misfit > 1.0:
        return Rayleigh(values, covariance, misfit)
    wider = max(1.0, np.nan_to_num(misfit))
    mean = damping_rows(np.atleast_1d(np.exp(np.log(frequency).mean()))) * [1.0, -1.0]
    split = mean * math.sqrt(3.0) / float(ratio.mean())
    return Rayleigh(*fitted(np.vstack([rows / wider, split]), np.append(right / wider, 0.0)), misfit)


def rayleigh_of_matrices(mass: Array, stiffness: Array, damping: Array) -> tuple[Array, float]:
    """Return a0 and a1 (2,) by least squares over the entries (3, 3), and the share of C that they miss."""
    rows = np.column_stack([mass.ravel(), stiffness.ravel()])
    size = np.linalg.norm(rows, axis=0)
    values = np.linalg.lstsq(rows / size, damping.ravel(), rcond=None)[0] / size
    residual = damping.ravel() - rows @ values
    return values, float(np.linalg.norm(residual) / np.linalg.norm(damping))
