"""A set of poles and residues that was fitted to FRFs, with what is known of its errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array, ComplexArray

TERMS = 3  # that stand for the modes outside the band


def residual_columns(omega: Array, unit: float = 1.0) -> ComplexArray:
    """Return what the residual terms multiply, (n, 3): 1, (u/ω)², i (u/ω)³, for ω (n,) and the ``unit`` u.

    Far above its own frequency a mode of mass m is 1/(m s² (1 + 2 ζ ω_r / s + …)) with s = iω: an inertance,
    and what its damping adds to that. So is a sensor's time constant τ: it multiplies an inertance by
    1/(1 + 1/(τ s)). Far below its own frequency a mode is a compliance.
    """
    share = unit / omega
    return np.stack([np.ones(len(omega)), share**2, 1j * share**3], axis=1)


@dataclass(frozen=True)
class Scatter:
    """How repeats of a test differ.

    Attributes
    ----------
    deviation : (g, n, c) what each of g repeats adds to the error of the mean FRFs; 0 where it has no part.
    mean : (g,) number of the mean that each was taken for (the reference that was hit).
    """

    deviation: ComplexArray
    mean: np.ndarray

    def of(self, columns: np.ndarray) -> Scatter:
        """Return the repeats that have a part in ``columns`` (k,) of the responses."""
        deviation = self.deviation[:, :, columns]
        there = np.any(deviation != 0.0, axis=(1, 2))
        return Scatter(deviation[there], np.unique(self.mean[there], return_inverse=True)[1])


@dataclass(frozen=True)
class PoleFit:
    """Poles and residues that fit best.

    Attributes
    ----------
    omega, zeta : (m,) undamped frequency in rad/s and damping ratio.
    residues : (m, c) complex, m rad/(N s): the FRF is sum_r A_r/(i w - p_r) + conj(A_r)/(i w - conj(p_r)).
    residual_terms : (3, c): compliance (m/N), inertance (coefficient of 1/omega²), and the coefficient of
        i/omega³ (:func:`residual_columns`).
    joint : (c, 3m, 3m) covariance of (log omega, log zeta, imaginary part of the residues of response c) for
        noise that is independent from line to line, scaled by the residual.
    shifts : (c, g, 3m) what each of g repeats adds to their error, to first order; no rows without repeats.
    mean : (g,) number of the mean that each repeat was taken for.
    chi2 : weighted sum of squares.
    count : (real data, parameters).
    real : whether the modes were taken as real (normal).
    """

    omega: Array
    zeta: Array
    residues: ComplexArray
    residual_terms: Array
    joint: Array
    shifts: Array
    mean: np.ndarray
    chi2: float
    count: tuple[int, int]
    real: bool

    @property
    def poles(self) -> ComplexArray:
        """(m,) poles, rad/s."""
        return self.omega * (-self.zeta + 1j * np.sqrt(1.0 - self.zeta**2))

    @property
    def chi2_per_datum(self) -> float:
        """About 1 where the model is right and the noise stated; well above where a mode is missing."""
        data, parameters = self.count
        return self.chi2 / max(data - parameters, 1)

    def bic(self) -> float:
        """Bayesian information criterion; fitting below the stated noise gains nothing."""
        return criterion(self.chi2, self.count)

    def sd(self, gradient: Array, response: int) -> float:
        """Return the standard deviation of a function of (log omega, log zeta, Im A) with ``gradient``.

        It is the larger of what independent noise makes and of what the repeats show: the sum of squares of
        their shifts is the cluster-robust variance (Liang and Zeger, 1986), which holds noise that lines and
        responses share. That one is widened by Student's quantile over the normal one, with the degrees of
        freedom of Welch and Satterthwaite, since the repeats are few.
        """
        independent = float(np.sqrt(gradient @ self.joint[response] @ gradient))
        if not len(self.mean):
            return independent
        shown = np.bincount(self.mean, (self.shifts[response] @ gradient) ** 2)
        freedom = shown.sum() ** 2 / np.sum(shown**2 / (np.bincount(self.mean) - 1))
        return max(independent, float(np.sqrt(shown.sum())) * _widening(float(freedom)))

    def evaluate(self, omega: Array) -> ComplexArray:
        """Receptance (n, c) of the fit at angular frequencies (n,)."""
        s = 1j * omega[:, None]
        value = (1.0 / (s - self.poles)) @ self.residues + (
            1.0 / (s - self.poles.conj())
        ) @ self.residues.conj()
        total: ComplexArray = value + residual_columns(omega) @ self.residual_terms
        return total


def criterion(chi2: float, count: tuple[int, int]) -> float:
    """Bayesian information criterion of a fit by its weighted sum of squares, (real data, parameters)."""
    data, parameters = count
    return data * float(np.log1p(chi2 / data)) + parameters * float(np.log(data))


def _widening(freedom: float) -> float:
    from scipy import stats

    return float(stats.t.ppf(0.975, freedom) / stats.norm.ppf(0.975))
