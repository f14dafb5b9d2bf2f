"""Poly-reference least-squares complex frequency: poles of a right matrix fraction, for one model order.

Guillaume, Verboven, Vanlanduit, Van der Auweraer, Peeters (2003). ``H(omega) = B(z) A(z)^-1`` with real
coefficients and ``z = exp(i pi f / f_max)`` counted from 0 Hz whatever the band, so that a band does not
alias.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array, ComplexArray


@dataclass(frozen=True)
class NormalEquations:
    """Reduced normal equations at the highest order; lower orders are their leading blocks.

    ``blocks`` are R (outputs, p+1, p+1), S (outputs, p+1, (p+1) i), T (outputs, (p+1) i, (p+1) i) for i
    inputs.
    """

    blocks: tuple[Array, Array, Array]
    inputs: int
    sampling_s: float


def normal_equations(frequency: Array, frf: ComplexArray, weight: Array, order: int) -> NormalEquations:
    """Set up the normal equations for orders up to ``order``.

    Parameters
    ----------
    frequency : (n,) Hz, of the band only.
    frf : (n, outputs, inputs).
    weight : (n, outputs) of the equations; 1 / standard deviation.
    """
    inputs = frf.shape[2]
    sampling = 0.5 / frequency[-1]
    powers = np.exp(2j * np.pi * frequency[:, None] * sampling * np.arange(order + 1))
    rows, mixed, squares = [], [], []
    for output in range(frf.shape[1]):
        x = powers * weight[:, output, None]
        y = (x[:, :, None] * -frf[:, output, None, :]).reshape(len(frequency), -1)
        rows.append((x.conj().T @ x).real)
        mixed.append((x.conj().T @ y).real)
        squares.append((y.conj().T @ y).real)
    return NormalEquations((np.stack(rows), np.stack(mixed), np.stack(squares)), inputs, sampling)


def poles(equations: NormalEquations, order: int) -> ComplexArray:
    """Stable poles (rad/s, positive imaginary part) of the model of ``order``, lowest coefficient identity.

    That constraint leaves the poles of the noise unstable, so that they can be told apart.
    """
    R, S, T = equations.blocks
    i, p = equations.inputs, order + 1
    reduced = np.zeros((p * i, p * i))
    for r, s, t in zip(R[:, :p, :p], S[:, :p, : p * i], T[:, : p * i, : p * i], strict=True):
        reduced += t - s.T @ np.linalg.lstsq(r, s, rcond=None)[0]
    coefficients = np.linalg.lstsq(reduced[i:, i:], -reduced[i:, :i], rcond=None)[0]
    alpha = np.concatenate([np.eye(i), coefficients]).reshape(p, i, i)
    # companion of A(z)' in w = 1/z: the lowest coefficient is the identity, so no inverse is needed
    companion = np.zeros((order * i, order * i))
    companion[: -i or None, i:] = np.eye((order - 1) * i) if order > 1 else companion[: -i or None, i:]
    for k in range(order):
        companion[-i:, k * i : (k + 1) * i] = -alpha[order - k].T
    inverse = np.linalg.eigvals(companion)
    inverse = inverse[np.abs(inverse) > 1e-12]
    found: ComplexArray = -np.log(inverse) / equations.sampling_s
    return found[(found.real < 0.0) & (found.imag > 0.0)]


def stable_poles(
    frequency: Array, frf: ComplexArray, weight: Array, orders: range
) -> list[tuple[complex, int]]:
    """Clusters (median pole, at how many orders it was found) of recurring poles, frequent first.

    Poles of neighbouring orders belong together when they differ by less than 2 % of frequency and 30 % of
    damping, which keeps weakly excited modes and does not merge close pairs.
    """
    equations = normal_equations(frequency, frf, weight, orders[-1])
    clusters: list[list[complex]] = []
    for order in orders:
        for pole in poles(equations, order):
            if not 0.7 * frequency[0] < abs(pole) / (2 * np.pi) < 1.3 * frequency[
                -1
            ] or -pole.real > 0.4 * abs(pole):
                continue
            near = [cluster for cluster in clusters if _same(cluster[-1], complex(pole))]
            if near:
                min(near, key=lambda cluster: abs(cluster[-1] - pole)).append(complex(pole))
            else:
                clusters.append([complex(pole)])
    found = [(complex(np.median(np.real(c)), np.median(np.imag(c))), len(c)) for c in clusters]
    return sorted(found, key=lambda item: -item[1])


def _same(a: complex, b: complex) -> bool:
    zeta_a, zeta_b = -a.real / abs(a), -b.real / abs(b)
    return abs(abs(a) / abs(b) - 1.0) < 0.02 and abs(zeta_a / zeta_b - 1.0) < 0.3
