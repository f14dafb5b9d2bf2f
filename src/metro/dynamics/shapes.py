"""Mode shapes: residues for given poles (LSFD), how alike two shapes are (MAC), how real one is (MPC)."""

from __future__ import annotations

import numpy as np

from metro.dynamics.polefit import residual_columns
from metro.units import Array, ComplexArray


def residues(omega: Array, frf: ComplexArray, weight: Array, poles: ComplexArray) -> ComplexArray:
    """Least-squares frequency-domain residues (m, c) of poles (m,), with residual terms.

    Parameters
    ----------
    omega : (n,) rad/s.
    frf : (n, c).
    weight : (n,) of the lines, for all responses alike.
    """
    s = 1j * omega[:, None]
    plus, minus = 1.0 / (s - poles), 1.0 / (s - poles.conj())
    outside = residual_columns(omega, float(omega[0]))
    basis = np.concatenate([plus + minus, 1j * (plus - minus), outside], axis=1) * weight[:, None]
    scale = np.linalg.norm(basis, axis=0)
    target = frf * weight[:, None]
    q, r = np.linalg.qr(np.concatenate([basis.real, basis.imag]) / scale)
    x = np.linalg.pinv(r) @ (q.T @ np.concatenate([target.real, target.imag])) / scale[:, None]
    m = len(poles)
    shapes: ComplexArray = x[:m] + 1j * x[m : 2 * m]
    return shapes


def mac(a: ComplexArray, b: ComplexArray) -> Array:
    """Modal assurance criterion (m, k) of shapes a (m, c) and b (k, c): 1 where they are proportional.

    Allemang (2003).
    """
    power = np.sum(np.abs(a) ** 2, axis=1)[:, None] * np.sum(np.abs(b) ** 2, axis=1)
    criterion: Array = np.abs(a.conj() @ b.T) ** 2 / power
    return criterion


def mpc(shape: ComplexArray) -> float:
    """Modal phase collinearity of a shape (c,): 1 where all its components have one phase or its opposite.

    Pappa, Elliott, Schenk (1993), with the shape as it is, not less its mean: a component represents a motion
    against the ground.
    """
    xx, yy = float(shape.real @ shape.real), float(shape.imag @ shape.imag)
    xy = float(shape.real @ shape.imag)
    return ((xx - yy) ** 2 + 4.0 * xy**2) / (xx + yy) ** 2
