"""Maximum-likelihood refinement of poles: variable projection, residues and residual terms linear.

Golub and Pereyra (1973) with Kaufman's Jacobian. Each response has, per mode, one residue (imaginary for real
modes, else complex), and the residual terms 1 and 1/omega² of the modes outside the band.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array, ComplexArray


@dataclass(frozen=True)
class Data:
    """FRFs to be fitted: ``omega`` (n,) rad/s, ``frf`` (n, c), ``weight`` (n, c) = 1 / standard deviation."""

    omega: Array
    frf: ComplexArray
    weight: Array

    def thinned(self, lines: int) -> Data:
        """Every so many-th line, so that at most ``lines`` are left."""
        every = -(-len(self.omega) // lines)
        return Data(self.omega[::every], self.frf[::every], self.weight[::every])


@dataclass(frozen=True)
class PoleFit:
    """Poles and residues that fit best.

    Attributes
    ----------
    omega, zeta : (m,) undamped frequency in rad/s and damping ratio.
    covariance : (2m, 2m) of (log omega, log zeta), scaled by the residual.
    residues : (m, c) complex, m rad/(N s): the FRF is sum_r A_r/(i w - p_r) + conj(A_r)/(i w - conj(p_r)).
    residue_sd : (m, c) standard deviation of the residues' imaginary parts, poles' uncertainty included.
    residual_terms : (2, c): compliance (m/N) and inertance (coefficient of 1/omega²).
    chi2 : weighted sum of squares.
    count : (real data, parameters).
    real : whether the modes were taken as real (normal).
    """

    omega: Array
    zeta: Array
    covariance: Array
    residues: ComplexArray
    residue_sd: Array
    residual_terms: Array
    chi2: float
    count: tuple[int, int]
    real: bool

    @property
    def poles(self) -> ComplexArray:
        """(m,) poles, rad/s."""
        return self.omega * (-self.zeta + 1j * np.sqrt(1.0 - self.zeta**2))

    def bic(self) -> float:
        """Bayesian information criterion; fitting below the stated noise gains nothing."""
        data, parameters = self.count
        return data * float(np.log1p(self.chi2 / data)) + parameters * float(np.log(data))

    def evaluate(self, omega: Array) -> ComplexArray:
        """Receptance (n, c) of the fit at angular frequencies (n,)."""
        s = 1j * omega[:, None]
        value = (1.0 / (s - self.poles)) @ self.residues + (
            1.0 / (s - self.poles.conj())
        ) @ self.residues.conj()
        total: ComplexArray = value + self.residual_terms[0] + self.residual_terms[1] / omega[:, None] ** 2
        return total


def refine(data: Data, omega: Array, zeta: Array, *, real: bool, iterations: int = 30) -> PoleFit:
    """Levenberg–Marquardt on (log omega, log zeta) from starting poles; ``real`` for real (normal) modes."""
    theta = np.concatenate([np.log(omega), np.log(zeta)])
    low, high = _bounds(data, len(omega))
    damping = 1e-3
    residual, jacobian, _ = _project(data, theta, real)
    chi2 = float(residual @ residual)
    for _ in range(iterations):
        normal = jacobian.T @ jacobian
        step = -np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-30), jacobian.T @ residual)
        trial = np.clip(theta + np.clip(step, -0.3, 0.3), low, high)
        new_residual, new_jacobian, _ = _project(data, trial, real)
        new = float(new_residual @ new_residual)
        if new < chi2:
            done = chi2 - new < 1e-9 * chi2
            theta, residual, jacobian, chi2, damping = trial, new_residual, new_jacobian, new, damping / 5
            if done:
                break
        else:
            damping *= 8
            if damping > 1e8:
                break
    return _finish(data, theta, real)


def _bounds(data: Data, modes: int) -> tuple[Array, Array]:
    edges = np.log([0.7 * data.omega[0], 1.3 * data.omega[-1]])
    zetas = np.log([1e-4, 0.4])
    return np.repeat([edges[0], zetas[0]], modes), np.repeat([edges[1], zetas[1]], modes)


def _basis(omega: Array, theta: Array, *, real: bool) -> tuple[ComplexArray, ComplexArray]:
    """Columns (n, u m + 2) that the linear unknowns multiply, and their slopes (n, 2, u, m).

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
    outside = np.stack([np.ones(len(omega)), omega[0] ** 2 / omega**2], axis=1)
    changes = [[u * p * plus**2 + np.conj(u * p) * minus**2 for u in units] for p in slopes]
    return np.concatenate([*columns, outside], axis=1), np.array(changes).transpose(2, 0, 1, 3)


def _project(data: Data, theta: Array, real: bool) -> tuple[Array, Array, list[tuple[Array, Array, Array]]]:
    """Residual (2 n c,), Jacobian (2 n c, 2m), and per response unknowns, covariance, slopes."""
    basis, slopes = _basis(data.omega, theta, real=real)
    scale = np.linalg.norm(basis, axis=0)
    lines, _, units, m = slopes.shape
    residuals, jacobians, linear = [], [], []
    for c in range(data.frf.shape[1]):
        weight = data.weight[:, c, None]
        q, r = np.linalg.qr(_stack(basis / scale * weight))
        target = _stack(data.frf[:, c, None] * weight)[:, 0]
        projected = q.T @ target
        inverse = np.linalg.pinv(r)
        x = inverse @ projected / scale
        change = np.einsum("nsum,um->nsm", slopes, x[: units * m].reshape(units, m)).reshape(lines, 2 * m)
        moved = _stack(change * weight)
        along = q.T @ moved
        residuals.append(q @ projected - target)
        jacobians.append(moved - q @ along)
        linear.append(
            (x, (inverse @ inverse.T) / np.outer(scale, scale), -(inverse @ along) / scale[:, None])
        )
    return np.concatenate(residuals), np.concatenate(jacobians), linear


def chi2_without(data: Data, fit: PoleFit, mode: int) -> float:
    """Weighted sum of squares with one mode left out and the other poles as they are."""
    keep = np.arange(len(fit.omega)) != mode
    theta = np.log(np.concatenate([fit.omega[keep], fit.zeta[keep]]))
    basis = _basis(data.omega, theta, real=fit.real)[0]
    basis = basis / np.linalg.norm(basis, axis=0)
    total = 0.0
    for c in range(data.frf.shape[1]):
        weight = data.weight[:, c, None]
        q = np.linalg.qr(_stack(basis * weight))[0]
        target = _stack(data.frf[:, c, None] * weight)[:, 0]
        total += float(np.sum((target - q @ (q.T @ target)) ** 2))
    return total


def _stack(values: ComplexArray) -> Array:
    return np.concatenate([values.real, values.imag])


def _finish(data: Data, theta: Array, real: bool) -> PoleFit:
    residual, jacobian, linear = _project(data, theta, real)
    m, responses = len(theta) // 2, data.frf.shape[1]
    parameters = 2 * m + responses * ((1 if real else 2) * m + 2)
    chi2 = float(residual @ residual)
    noise = chi2 / max(len(residual) - parameters, 1)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * noise
    unknowns = np.stack([x for x, _, _ in linear], axis=1)
    residues = np.asarray(1j * unknowns[:m] + (0.0 if real else unknowns[m : 2 * m]), dtype=np.complex128)
    variance = [np.diag(own * noise + slope @ covariance @ slope.T)[:m] for _, own, slope in linear]
    terms = unknowns[-2:] * np.array([[1.0], [data.omega[0] ** 2]])
    sd = np.sqrt(np.stack(variance, axis=1))
    omega, zeta, count = np.exp(theta[:m]), np.exp(theta[m:]), (len(residual), parameters)
    return PoleFit(omega, zeta, covariance, residues, sd, terms, chi2, count, real)
