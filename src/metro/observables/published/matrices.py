"""Printed mass, stiffness and damping matrices of a tip, and whether the printed a0 and a1 reproduce C."""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.surface.tip_damping import rayleigh_of_matrices
from metro.surface.tip_field import least_eigenvalue
from metro.units import Array

MATRICES = ("mass matrix", "stiffness matrix", "damping matrix")
COEFFICIENTS = ("a0", "a1")
COLUMNS = ("table", "row", "a0", "a1", "missed_percent", "a0_printed", "a1_printed", "printed_missed_percent")
ROUNDING = 1.0  # percent of C: residual that few printed digits of a0 and a1 may cause


def matrices(published: pd.DataFrame) -> pd.DataFrame:
    """Fit C = a0 M + a1 K to printed matrices, and compare the a0 and a1 that were printed with them.

    Parameters
    ----------
    published : rows of published.csv; entries have quantity ``mass matrix`` (kg), ``stiffness matrix`` (N/m)
        or ``damping matrix`` (N s/m) and axis ``xx``, ``xy``, …; of two symmetric entries only one is given.

    Returns
    -------
    One row per printed point with all three matrices: least-squares a0 (1/s) and a1 (s), their residual as a
    share of C (Frobenius), a0 and a1 as printed for the table, the residual of those, ``flag``.
    """
    axis = published["axis"].astype(str)
    entries_of_matrices = published[published["quantity"].isin(MATRICES) & axis.str.fullmatch("[xyz]{2}")]
    rows = []
    for (table, row), part in entries_of_matrices.groupby(["table", "row"], sort=False):
        matrix_of = {name: _matrix(entries) for name, entries in part.groupby("quantity", sort=False)}
        if not set(MATRICES) <= set(matrix_of):
            continue
        mass, stiffness, damping = (matrix_of[name] for name in MATRICES)
        (a0, a1), missed = rayleigh_of_matrices(mass, stiffness, damping)
        printed = _coefficients(published[published["table"] == table])
        residual = damping - printed[0] * mass - printed[1] * stiffness
        off = float(np.linalg.norm(residual) / np.linalg.norm(damping))
        wrong = [name for name in MATRICES if least_eigenvalue(matrix_of[name][None])[0] <= 0]
        flag = "; ".join(
            [
                *(f"the printed {name} is not positive definite" for name in wrong),
                *_unlike(off, missed, printed, (a0, a1)),
            ]
        )
        rows.append((table, row, a0, a1, 100 * missed, *printed, 100 * off, flag))
    return pd.DataFrame(rows, columns=[*COLUMNS, "flag"])


def _unlike(
    off: float, missed: float, printed: tuple[float, float], fitted: tuple[float, float]
) -> list[str]:
    if not 100 * off > ROUNDING + 100 * missed:
        return []
    return [
        f"the printed a0 {printed[0]:g} and a1 {printed[1]:g} miss the printed damping matrix by "
        f"{100 * off:.0f} %; least squares gives {fitted[0]:.4f} and {fitted[1]:.5f}, and misses it by "
        f"{100 * missed:.1g} %"
    ]


def _matrix(entries: pd.DataFrame) -> Array:
    matrix = np.zeros((3, 3))
    for axis, value in zip(entries["axis"].astype(str), entries["measured"].astype(float), strict=True):
        i, j = ("xyz".index(letter) for letter in axis)
        matrix[i, j] = matrix[j, i] = value
    return matrix


def _coefficients(table: pd.DataFrame) -> tuple[float, float]:
    """Return a0 and a1 as a table prints them, or NaN if it does not."""
    values = [table.loc[table["quantity"] == name, "measured"].astype(float) for name in COEFFICIENTS]
    a0, a1 = (float(each.iloc[0]) if len(each) else float("nan") for each in values)
    return a0, a1
