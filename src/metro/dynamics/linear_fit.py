"""Residues and residual terms for given poles: linear least squares of many responses at once.

Responses whose weights differ by a factor alone share their basis: it is decomposed once, and what a change
of the poles makes of all of them is one small matrix. That is so wherever the scatter is the same share of
each response, or one number.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array, ComplexArray

_ALIKE = 1e-9  # relative difference of weights that are one


@dataclass(frozen=True)
class Alike:
    """Responses ``columns`` (c,) whose weights are ``weight`` (n,) times their ``scale`` (c,)."""

    columns: np.ndarray
    weight: Array
    scale: Array


@dataclass(frozen=True)
class LinearFit:
    """Fit of c alike responses with u m + 3 unknowns each, for m poles; u = 1 (real modes) or 2.

    Attributes
    ----------
    of : the responses.
    unknowns : (u m + 3, c) ``solve`` times the data under ``of.weight``.
    residual : (2 n, c) of the data under ``of.weight``, real parts first.
    solve : (u m + 3, 2 n).
    spread : (u m + 3, u m + 3) covariance of the unknowns for given poles and unit noise under ``of.weight``.
    slopes : (2 n, 2, u, m) how the weighted columns change with (log omega, log zeta) of their mode, clear of
        what the unknowns can follow.
    followed : (u m + 3, 2, u, m) how the unknowns follow.
    """

    of: Alike
    unknowns: Array
    residual: Array
    solve: Array
    spread: Array
    slopes: Array
    followed: Array

    @property
    def shares(self) -> Array:
        """(u, m, c) unknowns that multiply the modes' columns."""
        units, m = self.slopes.shape[2:]
        return self.unknowns[: units * m].reshape(units, m, -1)

    @property
    def chi2(self) -> float:
        """Weighted sum of squares of all responses."""
        return float(np.sum(self.of.scale**2 * np.sum(self.residual**2, axis=0)))

    def gradient(self) -> Array:
        """(2 m,) half the derivative of :attr:`chi2` by (log omega, log zeta)."""
        size, m = self.slopes.shape[0], self.slopes.shape[3]
        along = self.slopes.reshape(size, -1).T @ (self.residual * self.of.scale**2)
        along = along.reshape(*self.slopes.shape[1:], -1)
        return np.asarray(np.einsum("sumc,umc->sm", along, self.shares)).reshape(2 * m)

    def normal(self) -> Array:
        """(2 m, 2 m) normal matrix of (log omega, log zeta)."""
        size, m = self.slopes.shape[0], self.slopes.shape[3]
        flat = self.slopes.reshape(size, -1)
        products = (flat.T @ flat).reshape(*self.slopes.shape[1:], *self.slopes.shape[1:])
        shares = self.shares.reshape(-1, len(self.of.scale))
        power = ((shares * self.of.scale**2) @ shares.T).reshape(
            *self.slopes.shape[2:], *self.slopes.shape[2:]
        )
        total = np.einsum("sumtvk,umvk->smtk", products, power)
        return np.asarray(total).reshape(2 * m, 2 * m)

    def pull(self, which: int, deviation: Array) -> Array:
        """(2 m, g) gradient by (log omega, log zeta) of ``deviation`` (2 n, g), under ``of.weight``."""
        size, m = self.slopes.shape[0], self.slopes.shape[3]
        along = (self.slopes.reshape(size, -1).T @ deviation).reshape(*self.slopes.shape[1:], -1)
        pulled = np.einsum("sumg,um->smg", along, self.shares[:, :, which]).reshape(2 * m, -1)
        result: Array = self.of.scale[which] ** 2 * pulled
        return result

    def slope(self, which: int) -> Array:
        """(u m + 3, 2 m) change of the unknowns of response ``which`` of these with (log omega, log zeta)."""
        moved = np.einsum("psum,um->psm", self.followed, self.shares[:, :, which])
        return -np.asarray(moved).reshape(len(self.followed), -1)

    def own(self, which: int) -> Array:
        """(u m + 3, u m + 3) covariance of the unknowns of ``which`` for unit noise and given poles."""
        result: Array = self.spread / self.of.scale[which] ** 2
        return result


def alike(weight: Array) -> tuple[Alike, ...]:
    """Sort the responses by the course of their weights (n, c) over the lines."""
    scale = np.sqrt(np.mean(weight**2, axis=0))
    shape = weight / scale
    groups: list[Alike] = []
    left = np.arange(weight.shape[1])
    while len(left):
        first = shape[:, left[:1]]
        same = np.max(np.abs(shape[:, left] - first), axis=0) < _ALIKE * np.max(first)
        groups.append(Alike(left[same], first[:, 0], scale[left[same]]))
        left = left[~same]
    return tuple(groups)


def linear_fit(basis: ComplexArray, slopes: ComplexArray, frf: ComplexArray, of: Alike) -> LinearFit:
    """Fit the unknowns of alike responses.

    Parameters
    ----------
    basis : (n, u m + 3) columns that the unknowns multiply.
    slopes : (n, 2, u, m) changes of the first u m of them with (log omega, log zeta) of their mode.
    frf : (n, all responses).
    """
    size = np.linalg.norm(basis, axis=0)
    weight = of.weight[:, None]
    q, r = np.linalg.qr(stacked(basis / size * weight))
    inverse = np.linalg.pinv(r) / size[:, None]
    target = stacked(frf[:, of.columns] * weight)
    projected = q.T @ target
    moved = stacked(slopes.reshape(len(slopes), -1) * weight)
    along = q.T @ moved
    return LinearFit(
        of,
        inverse @ projected,
        q @ projected - target,
        inverse @ q.T,
        inverse @ inverse.T,
        (moved - q @ along).reshape(-1, *slopes.shape[1:]),
        (inverse @ along).reshape(-1, *slopes.shape[1:]),
    )


def stacked(values: ComplexArray) -> Array:
    """Real parts above imaginary parts."""
    return np.concatenate([values.real, values.imag])
