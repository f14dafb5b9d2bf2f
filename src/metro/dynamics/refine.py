"""Maximum-likelihood refinement of poles: variable projection, residues and residual terms linear.

Golub and Pereyra (1973) with Kaufman's Jacobian. Each response has, per mode, one residue (imaginary for real
modes, else complex), and the residual terms of the modes outside the band (``polefit.residual_columns``).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from metro.dynamics.linear_fit import Alike, LinearFit, alike, linear_fit, stacked
from metro.dynamics.polefit import TERMS, PoleFit, Scatter, residual_columns
from metro.units import Array, ComplexArray


@dataclass(frozen=True)
class Data:
    """FRFs to be fitted.

    Attributes
    ----------
    omega : (n,) rad/s.
    frf : (n, c), the inputs of one output side by side.
    weight : (n, c), 1 / standard deviation.
    inputs : how many of the columns belong to one output.
    scatter : how the repeats of the test differ, on these lines; None where that is not known.
    """

    omega: Array
    frf: ComplexArray
    weight: Array
    inputs: int = 1
    scatter: Scatter | None = None

    @cached_property
    def alike(self) -> tuple[Alike, ...]:
        """Which responses share the course of their weights."""
        return alike(self.weight)

    def thinned(self, lines: int) -> Data:
        """Every so many-th line, so that at most ``lines`` are left; without the scatter."""
        every = -(-len(self.omega) // lines)
        return Data(self.omega[::every], self.frf[::every], self.weight[::every], self.inputs)

    def of(self, columns: np.ndarray) -> Data:
        """Return some of the responses, each as an output of its own."""
        scatter = None if self.scatter is None else self.scatter.of(columns)
        return Data(self.omega, self.frf[:, columns], self.weight[:, columns], 1, scatter)


def refine(
    data: Data,
    omega: Array,
    zeta: Array,
    *,
    real: bool,
    iterations: int = 30,
    free: np.ndarray | None = None,
) -> PoleFit:
    """Levenberg–Marquardt on (log omega, log zeta) from starting poles.

    Parameters
    ----------
    real : for real (normal) modes.
    free : (m,) whether the pole of each mode is fitted; None: all are. One that is not has no error.
    """
    theta = np.concatenate([np.log(omega), np.log(zeta)])
    fitted = np.arange(len(theta)) if free is None else np.flatnonzero(np.concatenate([free, free]))
    low, high = _bounds(data, len(omega))
    damping = 1e-3
    chi2, gradient, normal = _quadratic(data, theta, real)
    for _ in range(iterations):
        curved = normal[np.ix_(fitted, fitted)]
        step = np.zeros(len(theta))
        step[fitted] = -np.linalg.solve(curved + damping * np.diag(np.diag(curved) + 1e-30), gradient[fitted])
        trial = np.clip(theta + np.clip(step, -0.3, 0.3), low, high)
        new, *slopes = _quadratic(data, trial, real)
        if new < chi2:
            done = chi2 - new < 1e-9 * chi2
            theta, chi2, (gradient, normal), damping = trial, new, slopes, damping / 5
            if done:
                break
        else:
            damping *= 8
            if damping > 1e8:
                break
    return _finish(data, theta, real, fitted)


def _bounds(data: Data, modes: int) -> tuple[Array, Array]:
    """Return the least and the largest (log omega, log zeta); a peak may be a tenth of a step wide."""
    edges = np.log([0.7 * data.omega[0], 1.3 * data.omega[-1]])
    step = float(np.median(np.diff(data.omega)))
    zetas = np.log([min(1e-4, 0.1 * step / data.omega[-1]), 0.4])
    return np.repeat([edges[0], zetas[0]], modes), np.repeat([edges[1], zetas[1]], modes)


def _basis(omega: Array, theta: Array, *, real: bool) -> tuple[ComplexArray, ComplexArray]:
    """Columns (n, u m + 3) that the linear unknowns multiply, and their slopes (n, 2, u, m).

    There are u = 1 (real modes) or 2 unknowns per mode and response. A slope is by (log omega, log zeta) of
    the column's own mode: it depends on no other.
    """
    m = len(theta) // 2
    w, zeta = np.exp(theta[:m]), np.exp(theta[m:])
    pole = w * (-zeta + 1j * np.sqrt(1.0 - zeta**2))
    slopes = (pole, w * zeta * (-1.0 - 1j * zeta / np.sqrt(1.0 - zeta**2)))
    s = 1j * omega[:, None]
    plus, minus = 1.0 / (s - pole), 1.0 / (s - pole.conj())
    units = (1j,) if real else (1j, 1.0)
    columns = [u * plus + np.conj(u) * minus for u in units]
    outside = residual_columns(omega, float(omega[0]))
    changes = [[u * p * plus**2 + np.conj(u * p) * minus**2 for u in units] for p in slopes]
    return np.concatenate([*columns, outside], axis=1), np.array(changes).transpose(2, 0, 1, 3)


def _fits(data: Data, theta: Array, real: bool) -> Iterator[LinearFit]:
    """Fit the unknowns of all responses for given poles."""
    basis, slopes = _basis(data.omega, theta, real=real)
    for of in data.alike:
        yield linear_fit(basis, slopes, data.frf, of)


def _quadratic(data: Data, theta: Array, real: bool) -> tuple[float, Array, Array]:
    """Weighted sum of squares, half its gradient (2m,), and the normal matrix (2m, 2m)."""
    chi2, gradient, normal = 0.0, np.zeros(len(theta)), np.zeros((len(theta), len(theta)))
    for each in _fits(data, theta, real):
        chi2 += each.chi2
        gradient += each.gradient()
        normal += each.normal()
    return chi2, gradient, normal


def losses(data: Data, fit: PoleFit) -> Array:
    """Return by how much the weighted sum of squares (m,) rises without a mode, other poles kept."""
    m, units = len(fit.omega), 1 if fit.real else 2
    total = np.zeros(m)
    own = np.arange(units) * m + np.arange(m)[:, None]
    for each in _fits(data, np.log(np.concatenate([fit.omega, fit.zeta])), fit.real):
        x = each.unknowns[own]  # (m, units, c)
        # Of two modes that coincide, as at a bound of the search, the unknowns are not determined: singular.
        known = np.linalg.pinv(each.spread[own[:, :, None], own[:, None, :]], hermitian=True)
        total += np.sum(each.of.scale**2 * np.sum(x * (known @ x), axis=1), axis=1)
    return total


def _finish(data: Data, theta: Array, real: bool, fitted: np.ndarray) -> PoleFit:
    chi2, _, normal = _quadratic(data, theta, real)
    m, responses = len(theta) // 2, data.frf.shape[1]
    count = 2 * len(data.omega) * responses, len(fitted) + responses * ((1 if real else 2) * m + TERMS)
    noise = chi2 / max(count[0] - count[1], 1)
    inverse = _inverse(normal, fitted)
    x = np.empty(((1 if real else 2) * m + TERMS, responses))
    joint = np.empty((responses, 3 * m, 3 * m))
    for each in _fits(data, theta, real):
        x[:, each.of.columns] = each.unknowns
        for i, column in enumerate(each.of.columns):
            # (log omega, log zeta, Im A) = move (log omega, log zeta), plus the residues' own scatter
            move = np.concatenate([np.eye(2 * m), each.slope(i)[:m]])
            covariance = move @ inverse @ move.T
            covariance[2 * m :, 2 * m :] += each.own(i)[:m, :m]
            joint[column] = noise * covariance
    return PoleFit(
        omega=np.exp(theta[:m]),
        zeta=np.exp(theta[m:]),
        residues=np.asarray(1j * x[:m] + (0.0 if real else x[m : 2 * m]), dtype=np.complex128),
        residual_terms=x[-TERMS:] * data.omega[0] ** np.array([[0], [2], [3]]),
        joint=joint,
        shifts=_shifts(data, theta, inverse, real=real),
        mean=np.zeros(0, dtype=int) if data.scatter is None else data.scatter.mean,
        chi2=chi2,
        count=count,
        real=real,
    )


def _inverse(normal: Array, fitted: np.ndarray) -> Array:
    """Inverse of the rows and columns ``fitted``, scaled: modes far weaker than others count; 0 elsewhere."""
    inner = normal[np.ix_(fitted, fitted)]
    scale = 1.0 / np.sqrt(np.diag(inner) + np.finfo(float).tiny)
    inverse = np.zeros_like(normal)
    inverse[np.ix_(fitted, fitted)] = np.linalg.pinv(inner * scale * scale[:, None]) * scale * scale[:, None]
    return inverse


def _shifts(data: Data, theta: Array, inverse: Array, *, real: bool) -> Array:
    """Return what each repeat adds to the error of (log omega, log zeta, Im A), (c, g, 3m)."""
    m = len(theta) // 2
    if data.scatter is None:
        return np.zeros((data.frf.shape[1], 0, 3 * m))
    repeats, responses = len(data.scatter.deviation), data.frf.shape[1]
    pull = np.zeros((2 * m, repeats))
    own, slope = np.empty((responses, m, repeats)), np.empty((responses, m, 2 * m))
    for each in _fits(data, theta, real):
        for i, column in enumerate(each.of.columns):
            deviation = stacked((data.scatter.deviation[:, :, column] * each.of.weight).T)
            pull += each.pull(i, deviation)
            own[column], slope[column] = each.solve[:m] @ deviation, each.slope(i)[:m]
    poles = inverse @ pull
    every = np.broadcast_to(poles, (responses, *poles.shape))
    return np.concatenate([every, own + slope @ poles], axis=1).transpose(0, 2, 1)
