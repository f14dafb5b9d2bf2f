"""Every depth and frequency at which a Floquet multiplier reaches the unit circle.

For ``mu = exp(i theta)`` the reciprocal depth ``1/a`` is an eigenvalue of ``S(theta) = (1 - 1/mu) K(theta)``,
and a crossing is a theta at which such an eigenvalue is real and positive. The eigenvalues are followed over
0 < theta <= pi with few points; the crossings found are then refined by Newton's method on theta with as many
points as it takes. At theta = pi the matrix is real: its real eigenvalues are the flips.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from metro.dynamics.collocation import Kernel
from metro.dynamics.system import Structure
from metro.units import Array, ComplexArray

_FOLLOWED = 8
_KEEP = 1.5  # candidates deeper than this many times the lowest cannot win after refinement


@dataclass(frozen=True)
class Candidates:
    """Approximate crossings: ``speed`` (c,) index, ``theta`` (c,) rad, ``inverse`` (c,) 1/depth in 1/m."""

    speed: np.ndarray
    theta: Array
    inverse: Array

    def take(self, which: np.ndarray) -> Candidates:
        """Those at the indices, or under the mask, ``which``."""
        return Candidates(self.speed[which], self.theta[which], self.inverse[which])

    def distinct(self) -> Candidates:
        """Each crossing once, where several starts led to it."""
        keys = np.stack([self.speed, np.round(np.log(self.inverse), 6)], axis=1)
        return self.take(np.unique(keys, axis=0, return_index=True)[1])

    @staticmethod
    def join(parts: Sequence[Candidates]) -> Candidates:
        """All of ``parts``, one after another."""
        return Candidates(
            np.concatenate([part.speed for part in parts]),
            np.concatenate([part.theta for part in parts]),
            np.concatenate([part.inverse for part in parts]),
        )


def angles(structure: Structure, period: Array, count: int) -> Array:
    """(k, t) multiplier angles in (0, pi]: ``count`` evenly spaced, more where a mode resonates sharply."""
    uniform = np.broadcast_to(np.pi * (np.arange(count) + 0.5) / count, (len(period), count))
    columns = [uniform]
    width = structure.zeta * structure.omega * period[:, None]
    at = structure.poles.imag * period[:, None]
    narrow = width.min(axis=0) < 2.0 * np.pi / count
    columns += [at[:, narrow] + step * width[:, narrow] for step in (-1.5, -0.5, 0.5, 1.5)]
    folded = np.abs((np.concatenate(columns, axis=1) + np.pi) % (2.0 * np.pi) - np.pi)
    inner = np.sort(np.clip(folded, 1e-3, np.pi - 1e-3), axis=1)
    return np.concatenate([inner, np.full((len(period), 2), (np.pi - 1e-3, np.pi))], axis=1)


def matrix(
    equation: Kernel, theta: Array, speed: np.ndarray | slice = slice(None)
) -> tuple[ComplexArray, ComplexArray]:
    """S(theta) and its derivative by theta, (c, n, n) each, at angles (c,) and speeds ``speed``."""
    volterra, states, drive = equation.volterra[speed], equation.states[speed], equation.drive[speed]
    decay, mu = equation.decay[speed], np.exp(1j * theta)[:, None]
    gain = decay / (mu - decay)
    slope = -1j * mu * decay / (mu - decay) ** 2
    turn = (1.0 - 1.0 / mu)[:, :, None]
    closed = volterra + (states * gain[:, None, :]) @ drive
    return turn * closed, (1j / mu)[:, :, None] * closed + turn * ((states * slope[:, None, :]) @ drive)


def scan(structure: Structure, equation: Kernel, count: int) -> Candidates:
    """Follow the eigenvalues over theta and return the crossings that may be the lowest at their speed."""
    theta = angles(structure, equation.period, count)
    k, t = theta.shape
    S = matrix(equation, theta.ravel(), np.repeat(np.arange(k), t))[0]
    values: ComplexArray = np.linalg.eigvals(S).astype(complex).reshape(k, t, -1)
    keep = min(_FOLLOWED, values.shape[2])
    order = np.argsort(-np.abs(values), axis=2)[:, :, :keep]
    values = np.take_along_axis(values, order, axis=2)
    speed, place, left, right = _links(values[:, :-1])
    a, b = values[speed, place, left], values[speed, place + 1, right]
    share = np.clip(a.imag / np.where(a.imag == b.imag, np.inf, a.imag - b.imag), 0.0, 1.0)
    inverse = a.real + share * (b.real - a.real)
    at = theta[speed, place] + share * (theta[speed, place + 1] - theta[speed, place])
    hopf = (a.imag * b.imag <= 0.0) & (inverse > 0.0)
    end = values[:, -1]
    row, column = np.nonzero((np.abs(end.imag) <= 1e-9 * np.abs(end)) & (end.real > 0.0))
    found = Candidates(
        np.concatenate([speed[hopf], row]),
        np.concatenate([at[hopf], np.full(len(row), np.pi)]),
        np.concatenate([inverse[hopf], end.real[row, column]]),
    )
    return _lowest_few(found, k)


def _links(values: ComplexArray) -> tuple[np.ndarray, ...]:
    """Pairs (speed, place, index there, index at the next place) of nearest eigenvalues, sought both ways."""
    distance = np.abs(values[:, :-1, :, None] - values[:, 1:, None, :])
    k, t, q, _ = distance.shape
    s, p, i = np.meshgrid(np.arange(k), np.arange(t), np.arange(q), indexing="ij")
    forward = (s, p, i, distance.argmin(axis=3))
    backward = (s, p, distance.argmin(axis=2), i)
    return tuple(np.concatenate([f.ravel(), b.ravel()]) for f, b in zip(forward, backward, strict=True))


def _lowest_few(found: Candidates, speeds: int) -> Candidates:
    """Drop what is repeated and what is too deep to become the lowest."""
    best = np.zeros(speeds)
    np.maximum.at(best, found.speed, found.inverse)
    keys = np.round(np.stack([found.speed, found.theta * 1e6, found.inverse], axis=1), 0)
    first = np.unique(keys, axis=0, return_index=True)[1]
    first = first[found.inverse[first] * _KEEP > best[found.speed[first]]]
    return Candidates(found.speed[first], found.theta[first], found.inverse[first])


def refine(equation: Kernel, start: Candidates, steps: int) -> tuple[Candidates, ComplexArray, np.ndarray]:
    """Newton's method on theta for a real eigenvalue of S(theta), by inverse iteration from both sides.

    Returns
    -------
    The refined candidates, their eigenvectors (c, n), and whether each converged to a crossing (c,).
    """
    theta, shift = start.theta.copy(), start.inverse.astype(complex)
    n = equation.states.shape[1]
    x = np.random.default_rng(0).normal(size=(len(theta), n)).astype(complex)
    y = x.copy()
    converged = np.zeros(len(theta), dtype=bool)
    for step in range(steps):
        S, slope = matrix(equation, theta, start.speed)
        shifted = np.linalg.inv(S - (shift * (1.0 + 1e-9))[:, None, None] * np.eye(n))
        for _ in range(4 if step == 0 else 1):  # the first vectors are random
            x, y = _unit(np.einsum("cij,cj->ci", shifted, x)), _unit(np.einsum("cji,cj->ci", shifted, y))
        pairing = np.einsum("ci,ci->c", y, x)
        image = np.einsum("cij,cj->ci", S, x)
        value = np.einsum("ci,ci->c", y, image) / pairing
        rate = np.einsum("ci,cij,cj->c", y, slope, x, optimize=True) / pairing
        change = np.clip(-value.imag / np.where(rate.imag == 0.0, np.inf, rate.imag), -0.3, 0.3)
        residual = np.linalg.norm(image - value[:, None] * x, axis=1)
        converged = np.maximum(residual, np.abs(value.imag)) < 1e-4 * np.abs(value)
        theta = theta + change
        shift = value + rate * change
    converged &= shift.real > 0.0
    return Candidates(start.speed, theta, shift.real), x, converged


def _unit(vectors: ComplexArray) -> ComplexArray:
    unit: ComplexArray = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return unit
