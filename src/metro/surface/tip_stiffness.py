"""Compliance of the arm at the tool's tip, from static load tests at points of the face.

At a point, displacement = C F with C a symmetric 3×3 matrix (reciprocity). Between points C varies with the
arm's posture; over a face that is small against the arm, a polynomial in (x, y) of low degree follows it, and
leaving out one load point at a time shows which degree predicts the points that were not loaded. Linearity is
checked, not assumed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array

PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
POWERS = ((0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2))
TERMS = (1, 3, 4, 6)  # constant, plane, bilinear, quadratic: leading entries of POWERS
PURE = 1e-6


@dataclass(frozen=True, eq=False)
class PointCompliance:
    """Compliance at a point: symmetric ``matrix`` (3, 3) m/N and ``sd``, NaN where no load shows it.

    ``residual_sd`` (m) is the scatter of the displacements about the straight line through the origin, with
    ``dof`` degrees of freedom.
    """

    matrix: Array
    sd: Array
    residual_sd: float
    dof: int


@dataclass(frozen=True, eq=False)
class Nonlinearity:
    """Displacement over force (3,), m/N, along a load direction (3,) at a smaller and a larger load (N)."""

    direction: Array
    loads: tuple[float, float]
    compliance: tuple[Array, Array]

    @property
    def relative(self) -> Array:
        """Change of each component between the loads, relative to the compliance along the load."""
        low, high = self.compliance
        return (high - low) / abs(float(np.nansum(low * self.direction)) or np.nan)


@dataclass(frozen=True, eq=False)
class Basis:
    """Polynomial terms over a face: coordinates are taken from ``centre`` (2,) in units of ``half`` (2,)."""

    centre: Array
    half: Array
    terms: int

    def __call__(self, x: Array, y: Array) -> Array:
        """Values (n, terms) at ``x``, ``y`` (n,)."""
        u, v = (x - self.centre[0]) / self.half[0], (y - self.centre[1]) / self.half[1]
        return np.column_stack([u**i * v**j for i, j in POWERS[: self.terms]])


def basis_over(x: Array, y: Array, terms: int) -> Basis:
    """Return the basis of so many ``terms`` over the extent of points ``x``, ``y`` (n,), m."""
    centre = np.array([np.mean([c.min(), c.max()]) for c in (x, y)])
    return Basis(centre, np.array([np.ptp(c) / 2 or 1.0 for c in (x, y)]), terms)


@dataclass(frozen=True, eq=False)
class Rows:
    """Evidence on the z row of C: displacements (n,) in m at ``x``, ``y`` by the effective ``force`` (n, 3).

    A displacement dz under F has the row F; a dx or dy under a pure z force shows C_xz = C_zx or C_yz = C_zy.
    ``axis`` names which displacement it was.
    """

    x: Array
    y: Array
    force: Array
    displacement: Array
    axis: np.ndarray

    def design(self, basis: Basis) -> Array:
        """Matrix (n, 3 · terms): the coefficients of C_zx, then of C_zy, then of C_zz."""
        return heights_design(basis, self.x, self.y, self.force)


def heights_design(basis: Basis, x: Array, y: Array, force: Array) -> Array:
    """Rows (n, 3 · terms) of Δz = Σ_j C_zj(x, y) F_j, with ``force`` (3,) or (n, 3) on the tool in N."""
    values = basis(x, y)
    forces = np.broadcast_to(force, (len(values), 3))
    return (forces[:, :, None] * values[:, None, :]).reshape(len(values), -1)


def point_compliance(force: Array, displacement: Array) -> PointCompliance:
    """Least squares through the origin of the loads at one point.

    Parameters
    ----------
    force, displacement : (m, 3) in N and m, the latter NaN where it was not measured.
    """
    load, axis = np.nonzero(np.isfinite(displacement))
    measured = displacement[load, axis]
    design = np.zeros((len(load), len(PAIRS)))
    for column, (i, j) in enumerate(PAIRS):
        design[axis == i, column] += force[load[axis == i], j]
        if i != j:
            design[axis == j, column] += force[load[axis == j], i]
    values, covariance, seen = _solve(design, measured)
    residual = measured - design @ values
    dof = len(measured) - int(np.linalg.matrix_rank(design))
    residual_sd = float(np.sqrt(residual @ residual / dof)) if dof > 0 else float("nan")
    values, sd = np.where(seen, values, np.nan), np.where(seen, np.sqrt(np.diag(covariance)), np.nan)
    return PointCompliance(_symmetric(values), residual_sd * _symmetric(sd), residual_sd, dof)


def _solve(design: Array, measured: Array) -> tuple[Array, Array, np.ndarray]:
    """Minimum-norm solution, its covariance for unit variance, and which unknowns the rows determine."""
    if not len(measured):
        unknowns = design.shape[1]
        return np.zeros(unknowns), np.zeros((unknowns, unknowns)), np.zeros(unknowns, dtype=bool)
    size = np.linalg.norm(design, axis=0)
    scale = np.where(size > 0, size, 1.0)
    inverse = np.linalg.pinv(design / scale, rcond=1e-8)
    seen = np.diag(inverse @ (design / scale)) > 1 - 1e-6
    return inverse @ measured / scale, inverse @ inverse.T / np.outer(scale, scale), seen


def _symmetric(values: Array) -> Array:
    matrix = np.empty((3, 3))
    for value, (i, j) in zip(values, PAIRS, strict=True):
        matrix[i, j] = matrix[j, i] = value
    return matrix


def points_compliance(
    position: Array, force: Array, displacement: Array
) -> tuple[Array, list[PointCompliance]]:
    """Return the places (k, 2) m of load tests, and the compliance at each; arguments (m, 3) each."""
    places, point = np.unique(position[:, :2].round(6), axis=0, return_inverse=True)
    return places, [
        point_compliance(force[point.ravel() == i], displacement[point.ravel() == i])
        for i in range(len(places))
    ]


def nonlinearity(force: Array, displacement: Array) -> list[Nonlinearity]:
    """Compare, for each direction that has several, the compliance at the least and the greatest load.

    Repeated loads are averaged; nothing is fitted across magnitudes. ``force``, ``displacement`` (m, 3) at
    one point.
    """
    size = np.linalg.norm(force, axis=1)
    unit = force / size[:, None]
    result = []
    left = np.ones(len(force), dtype=bool)
    while left.any():
        same = left & (unit @ unit[np.argmax(left)] > 1 - 1e-4)
        left &= ~same
        magnitude = np.round(size[same], 3)
        least, greatest = float(magnitude.min()), float(magnitude.max())
        if greatest > 1.05 * least:
            ratio = displacement[same] / size[same, None]
            low, high = (ratio[magnitude == load].mean(axis=0) for load in (least, greatest))
            result.append(Nonlinearity(unit[np.argmax(same)], (least, greatest), (low, high)))
    return result


def z_rows(x: Array, y: Array, force: Array, displacement: Array) -> Rows:
    """Collect what shows the z row of C from load tests: (n,), (n,), (n, 3), (n, 3), NaN where blank."""
    pure = np.hypot(force[:, 0], force[:, 1]) <= PURE * np.abs(force[:, 2])
    load, axis, effective = [], [], []
    for number in range(3):
        chosen = np.flatnonzero(np.isfinite(displacement[:, number]) & (pure | (number == 2)))
        load.append(chosen)
        axis.append(np.full(len(chosen), number))
        turned = np.zeros((len(chosen), 3))
        turned[:, number] = force[chosen, 2]
        effective.append(force[chosen] if number == 2 else turned)
    rows, axes = np.concatenate(load), np.concatenate(axis)
    return Rows(x[rows], y[rows], np.concatenate(effective), displacement[rows, axes], axes)


def visible_entries(rows: Rows) -> np.ndarray:
    """Which of C_zx, C_zy, C_zz the loads determine, (3,) booleans."""
    return _solve(rows.force, rows.displacement)[2]


def leave_one_out(rows: Rows, basis: Basis, entries: np.ndarray) -> float:
    """Return the rms error (m) of predicting each load point from all others; infinite where it cannot be."""
    design = rows.design(basis)[:, np.repeat(entries, basis.terms)]
    location = np.unique(np.column_stack([rows.x, rows.y]).round(6), axis=0, return_inverse=True)[1].ravel()
    errors = []
    for point in range(location.max() + 1):
        out = location == point
        values, _, seen = _solve(design[~out], rows.displacement[~out])
        if not seen.all():
            return float("inf")
        errors.append(rows.displacement[out] - design[out] @ values)
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def choose_basis(rows: Rows, entries: np.ndarray) -> tuple[Basis, float]:
    """Return the polynomial with the least leave-one-out error, and that error (m).

    A higher degree must be better by 5 %: a tie goes to the simpler field. One load point gives a constant.
    """
    best = basis_over(rows.x, rows.y, TERMS[0])
    least = leave_one_out(rows, best, entries)
    for terms in TERMS[1:]:
        basis = basis_over(rows.x, rows.y, terms)
        error = leave_one_out(rows, basis, entries)
        if error < 0.95 * least:
            best, least = basis, error
    return best, least


def fit_z_row(rows: Rows, basis: Basis, entries: np.ndarray) -> tuple[Array, float]:
    """Return coefficients (3 · terms) of the z row, m/N, zero without ``entries``; residual sd (m)."""
    used = np.repeat(entries, basis.terms)
    design = rows.design(basis)[:, used]
    values, _, _ = _solve(design, rows.displacement)
    residual = rows.displacement - design @ values
    coefficients = np.zeros(len(used))
    coefficients[used] = values
    return coefficients, float(np.sqrt(residual @ residual / max(1, len(residual) - design.shape[1])))
