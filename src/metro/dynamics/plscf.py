"""Poly-reference least-squares complex frequency: poles of a right matrix fraction, for every model order.

Guillaume, Verboven, Vanlanduit, Van der Auweraer, Peeters (2003). ``H(omega) = B(z) A(z)^-1`` with real
coefficients and ``z = exp(i pi f / f_max)`` counted from 0 Hz whatever the band, so that a band does not
alias.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array, ComplexArray

_RIDGE = 1e-13


@dataclass(frozen=True)
class NormalEquations:
    """Reduced normal equations of every order up to the highest.

    ``reduced`` (order + 1, (order + 1) i, (order + 1) i) for i inputs: those of order p are the leading
    (p + 1) i rows and columns of ``reduced[p]``.
    """

    reduced: Array
    inputs: int
    sampling_s: float


def normal_equations(frequency: Array, frf: ComplexArray, weight: Array, order: int) -> NormalEquations:
    """Set up the normal equations for orders up to ``order``.

    The numerators' block R of an output is Toeplitz, and the one of a lower order is its leading block; so is
    its Cholesky factor L, and so is V = L^-1 S: all orders are reduced, T - V'V, at the cost of the highest.

    Parameters
    ----------
    frequency : (n,) Hz, of the band only; lines may be missing.
    frf : (n, outputs, inputs).
    weight : (n, outputs) of the equations; 1 / standard deviation.
    """
    inputs, size = frf.shape[2], order + 1
    sampling = 0.5 / frequency[-1]
    square = weight**2
    auto = np.einsum("no,noi,noj->nij", square, frf.conj(), frf)
    cross = -square[:, :, None] * frf
    lags = _lags(frequency * sampling, order)
    R = _toeplitz(lags, square.astype(np.complex128), size)
    S = _toeplitz(lags, cross, size).transpose(2, 0, 1, 3).reshape(frf.shape[1], size, size * inputs)
    T = _toeplitz(lags, auto, size).transpose(0, 2, 1, 3).reshape(size * inputs, size * inputs)
    R = R.transpose(2, 0, 1) + _RIDGE * R[0, 0, :, None, None] * np.eye(size)
    V = np.linalg.solve(np.linalg.cholesky(R), S)
    reduced = np.empty((size, size * inputs, size * inputs))
    for k in range(size):
        T = T - V[:, k].T @ V[:, k]
        reduced[k] = T
    return NormalEquations(reduced, inputs, sampling)


def _lags(turns: Array, order: int) -> ComplexArray:
    """Powers 0 … order of z (order + 1, n) at frequencies given in turns per sample (n,)."""
    powers: ComplexArray = np.exp(2j * np.pi * np.arange(order + 1)[:, None] * turns)
    return powers


def _toeplitz(powers: ComplexArray, values: ComplexArray, size: int) -> Array:
    """Array (size, size, …) of Re sum over lines of z^(l - k) values (n, …), for row k and column l."""
    flat = values.reshape(len(values), -1)
    real, imaginary = powers.real @ flat.real, powers.imag @ flat.imag
    lag = np.concatenate([(real + imaginary)[:0:-1], real - imaginary])  # -order … order
    at = np.arange(size)
    blocks: Array = lag[at - at[:, None] + size - 1].reshape(size, size, *values.shape[1:])
    return blocks


def poles(equations: NormalEquations, order: int) -> ComplexArray:
    """Stable poles (rad/s, positive imaginary part) of the model of ``order``, lowest coefficient identity.

    That constraint leaves the poles of the noise unstable, so that they can be recognised.
    """
    i, p = equations.inputs, order + 1
    reduced = equations.reduced[order][: p * i, : p * i]
    coefficients = np.linalg.lstsq(reduced[i:, i:], -reduced[i:, :i], rcond=None)[0]
    alpha = np.concatenate([np.eye(i), coefficients]).reshape(p, i, i)
    # companion of A(z)' in w = 1/z: the lowest coefficient is the identity, so no inverse is needed
    companion = np.zeros((order * i, order * i))
    companion[:-i, i:] = np.eye((order - 1) * i)
    for k in range(order):
        companion[-i:, k * i : (k + 1) * i] = -alpha[order - k].T
    inverse = np.linalg.eigvals(companion).astype(complex)  # real ones alone would have no logarithm
    inverse = inverse[np.abs(inverse) > 1e-12]
    all_poles: ComplexArray = -np.log(inverse) / equations.sampling_s
    return all_poles[(all_poles.real < 0.0) & (all_poles.imag > 0.0)]
