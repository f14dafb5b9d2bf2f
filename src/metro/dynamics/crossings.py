"""Every depth and frequency at which a Floquet multiplier reaches the unit circle.

For ``mu = exp(i theta)`` the reciprocal depth ``1/a`` is an eigenvalue of ``S(theta) = (1 - 1/mu) K(theta)``,
and a crossing is a theta at which such an eigenvalue is real and positive. (Columns of process damping, which
is not delayed, are those of ``K(theta)``.) The eigenvalues are followed over 0 < theta <= pi with few points;
the crossings found are then refined by Newton's method on theta with as many points as it takes. At theta =
pi the matrix is real: its real eigenvalues are the flips.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from metro.dynamics.collocation import Kernel
from metro.dynamics.system import Structure
from metro.units import Array, ComplexArray

_FOLLOWED = 8
_FOLLOWED_DAMPED = 32  # with process damping many large eigenvalues never become a crossing
_AT_ONE = 1e-5  # half the angle of a multiplier, rad
_RESIDUAL = 1e-4  # of an eigenvalue: below it Newton's method has converged, or will in the steps to come


@dataclass(frozen=True)
class Candidates:
    """Approximate crossings: ``speed`` (c,) index, ``theta`` (c,) rad, ``inverse`` (c,) 1/depth in 1/m."""

    speed: np.ndarray
    theta: Array
    inverse: Array

    def take(self, which: np.ndarray) -> Candidates:
        """Those at the indices, or under the mask, ``which``."""
        return Candidates(self.speed[which], self.theta[which], self.inverse[which])

    def among(self, speeds: np.ndarray) -> Candidates:
        """Those at ``speeds`` (rising indices), which are numbered anew from 0."""
        chosen = self.take(np.isin(self.speed, speeds))
        return replace(chosen, speed=np.searchsorted(speeds, chosen.speed))

    def near_lowest(self, factor: float) -> Candidates:
        """Those up to ``factor`` times the lowest depth of their speed."""
        best = np.zeros(self.speed.max(initial=0) + 1)
        np.maximum.at(best, self.speed, self.inverse)
        return self.take(self.inverse * factor > best[self.speed])

    def distinct(self) -> np.ndarray:
        """Return the indices of each crossing once, where several starts led to it."""
        keys = np.stack([self.speed, np.round(np.log(self.inverse), 6)], axis=1)
        return np.unique(keys, axis=0, return_index=True)[1]

    @staticmethod
    def join(parts: Sequence[Candidates]) -> Candidates:
        """All of ``parts``, one after another."""
        return Candidates(
            np.concatenate([part.speed for part in parts]),
            np.concatenate([part.theta for part in parts]),
            np.concatenate([part.inverse for part in parts]),
        )


@dataclass(frozen=True)
class Refined:
    """Crossings after Newton's method.

    Attributes
    ----------
    at : the c crossings.
    shape : (c, n) eigenvectors: the vibration along the arc.
    left : (c, n) left eigenvectors, of which the product with the shape is 1.
    rate : (c,) derivative of the eigenvalue by theta, 1/m.
    converged : (c,) whether it is one.
    """

    at: Candidates
    shape: ComplexArray
    left: ComplexArray
    rate: ComplexArray
    converged: np.ndarray

    @property
    def leaves(self) -> np.ndarray:
        """(c,) whether the multiplier leaves the unit circle as the depth grows (else it comes back)."""
        # with 1/a = value(mu): d(log mu)/da = -i / (a² rate), whose real part has the sign of -Im rate
        leaves: np.ndarray = self.rate.imag < 0.0
        return leaves


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
    return np.concatenate([inner, np.full((len(period), 1), np.pi)], axis=1)


def matrix(equation: Kernel, theta: Array) -> ComplexArray:
    """S(theta) (k, t, n, n) at angles (k, t)."""
    mu = np.exp(1j * theta)[:, :, None]
    decay = equation.decay[:, None]
    gain = decay / (mu - decay)
    closed: ComplexArray = (equation.states[:, None] * gain[:, :, None, :]) @ equation.drive[:, None]
    closed += equation.volterra[:, None]
    closed *= 1.0 - equation.delayed / mu[:, :, :, None]
    return closed


def scan(structure: Structure, equation: Kernel, count: int, followed: float | None = None) -> Candidates:
    """Follow the eigenvalues over theta and return the crossings, roughly and some of them twice.

    At most ``followed`` eigenvalues of each angle, the largest that are not near the negative axis: these are
    the least depths. None: so many that a boundary's lowest crossing is among them.
    """
    followed = followed or (_FOLLOWED if equation.delayed.all() else _FOLLOWED_DAMPED)
    theta = angles(structure, equation.period, count)
    inner = np.linalg.eigvals(matrix(equation, theta[:, :-1])).astype(complex)
    values: ComplexArray = np.concatenate([inner, _at_flip(equation)], axis=1)
    keep = int(min(followed, values.shape[2]))
    order = np.argpartition(-np.abs(values) - values.real, keep - 1, axis=2)[:, :, :keep]
    values = np.take_along_axis(values, order, axis=2)
    speed, place, left, right = _links(values)
    a, b = values[speed, place, left], values[speed, place + 1, right]
    share = np.clip(a.imag / np.where(a.imag == b.imag, np.inf, a.imag - b.imag), 0.0, 1.0)
    inverse = a.real + share * (b.real - a.real)
    at = theta[speed, place] + share * (theta[speed, place + 1] - theta[speed, place])
    hopf = (a.imag * b.imag <= 0.0) & (inverse > 0.0)
    end = values[:, -1]
    row, column = np.nonzero((np.abs(end.imag) <= 1e-9 * np.abs(end)) & (end.real > 0.0))
    return Candidates(
        np.concatenate([speed[hopf], row]),
        np.concatenate([at[hopf], np.full(len(row), np.pi)]),
        np.concatenate([inverse[hopf], end.real[row, column]]),
    )


def _at_flip(equation: Kernel) -> ComplexArray:
    """Eigenvalues (k, 1, n) of S(pi), which is real, since poles come in conjugate pairs."""
    flip = matrix(equation, np.full((len(equation.period), 1), np.pi)).real
    return np.linalg.eigvals(flip).astype(complex)


def _links(values: ComplexArray) -> tuple[np.ndarray, ...]:
    """Pairs (speed, place, index there, index at the next place) of nearest eigenvalues, sought both ways."""
    distance = np.abs(values[:, :-1, :, None] - values[:, 1:, None, :])
    k, t, q, _ = distance.shape
    s, p, i = np.meshgrid(np.arange(k), np.arange(t), np.arange(q), indexing="ij")
    forward = (s, p, i, distance.argmin(axis=3))
    backward = (s, p, distance.argmin(axis=2), i)
    return tuple(np.concatenate([f.ravel(), b.ravel()]) for f, b in zip(forward, backward, strict=True))


def refine(equation: Kernel, start: Candidates, steps: int) -> Refined:
    """Newton's method on theta for a real eigenvalue of S(theta), by inverse iteration from both sides."""
    theta, shift = start.theta.copy(), start.inverse.astype(complex)
    here = equation.take(start.speed)
    n = here.states.shape[1]
    x = np.random.default_rng(0).normal(size=(len(theta), n, 1)).astype(complex)
    y = x.transpose(0, 2, 1)
    rate = np.zeros(len(theta), dtype=complex)
    converged = np.zeros(len(theta), dtype=bool)
    for step in range(steps):
        S = matrix(here, theta[:, None])[:, 0]
        shifted = np.linalg.inv(S - (shift * (1.0 + 1e-9))[:, None, None] * np.eye(n))
        for _ in range(4 if step == 0 else 1):  # the first vectors are random
            x, y = _unit(shifted @ x), _unit(y @ shifted)
        pairing = (y @ x)[:, 0, 0]
        image = S @ x
        value = (y @ image)[:, 0, 0] / pairing
        rate = (y @ _slope(here, theta, x))[:, 0, 0] / pairing
        change = np.clip(-value.imag / np.where(rate.imag == 0.0, np.inf, rate.imag), -0.3, 0.3)
        residual = np.linalg.norm(image - value[:, None, None] * x, axis=(1, 2))
        converged = np.maximum(residual, np.abs(value.imag)) < _RESIDUAL * np.abs(value)
        # at mu = 1 every depth is infinite: who gets there starts again
        lost = np.abs(np.sin((theta + change) / 2.0)) < _AT_ONE
        theta = np.where(lost, start.theta, theta + change)
        shift = np.where(lost, start.inverse, value + rate * change)
        converged &= ~lost
    converged &= shift.real > 0.0
    left = (y / (y @ x))[:, 0]
    return Refined(Candidates(start.speed, theta, shift.real), x[:, :, 0], left, rate, converged)


def applied(equation: Kernel, theta: Array, x: ComplexArray) -> ComplexArray:
    """Apply S(theta) to ``x`` (c, n), a speed of the equation for each."""
    mu = np.exp(1j * theta)[:, None]
    acting = (x * (1.0 - equation.delayed / mu))[:, :, None]
    gain = (equation.decay / (mu - equation.decay))[:, :, None]
    image: ComplexArray = equation.volterra @ acting + equation.states @ (gain * (equation.drive @ acting))
    return image[:, :, 0]


def _slope(equation: Kernel, theta: Array, x: ComplexArray) -> ComplexArray:
    """Apply the derivative of S(theta) by theta to ``x`` (c, n, 1)."""
    mu = np.exp(1j * theta)[:, None, None]
    decay = equation.decay[:, :, None]
    delayed = equation.delayed[:, None]
    acting, acting_slope = x * (1.0 - delayed / mu), 1j / mu * delayed * x
    gain, gain_slope = decay / (mu - decay), -1j * mu * decay / (mu - decay) ** 2
    driven = gain * (equation.drive @ acting_slope) + gain_slope * (equation.drive @ acting)
    change: ComplexArray = equation.volterra @ acting_slope + equation.states @ driven
    return change


def _unit(vectors: ComplexArray) -> ComplexArray:
    unit: ComplexArray = vectors / np.linalg.norm(vectors, axis=(1, 2), keepdims=True)
    return unit
