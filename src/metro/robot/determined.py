"""Least squares of many columns, of which the data determine only some combinations.

The columns of a rigid arm outnumber what its torques can determine. The fit keeps the directions that the
data determine; a combination of the coefficients has a value only where it lies within these. Its error is
that of a jackknife over stretches (Miller, Biometrika 61, 1974), since neighbouring samples are not
independent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array

STRETCHES = 30
RANK = 1e-5
ROUNDING = 1e-12  # a column this small beside the largest is zero but for rounding
DETERMINED = 0.999  # length of a combination's direction within those that the data determine


@dataclass(frozen=True, eq=False)
class Determined:
    """Coefficients of p columns, of least norm where the data do not determine them.

    Attributes
    ----------
    value : (p,). replicates : (g, p) without one stretch each.
    axes : (rank, p) the directions that are determined, of coefficients times ``scale`` (p,), which is
        infinite for a column of nothing. spread : (rank,) their singular values, greatest first.
    """

    value: Array
    replicates: Array
    axes: Array
    scale: Array
    spread: Array

    @property
    def known(self) -> np.ndarray:
        """Return which coefficients the data determine, (p,) bool."""
        return np.asarray(np.linalg.norm(self.axes, axis=0) > DETERMINED)

    @property
    def condition(self) -> float:
        """Greatest over least singular value of what is determined."""
        return float(self.spread[0] / self.spread[-1])

    def combination(self, weights: Array) -> tuple[float, float]:
        """Value and standard error of Σ w β, ``weights`` (p,); NaN where the data do not determine it."""
        scaled = weights / self.scale
        size = float(np.linalg.norm(scaled))
        least = ROUNDING * float(np.abs(weights).max(initial=0.0))
        lost = bool((np.abs(weights[np.isinf(self.scale)]) > least).any())
        if lost or size == 0.0 or np.linalg.norm(self.axes @ scaled) < DETERMINED * size:
            return np.nan, np.nan
        left_out = self.replicates @ weights
        count = len(left_out)
        return float(self.value @ weights), float(np.sqrt((count - 1) * left_out.var()))


def solve(columns: Array, measured: Array, stretch: np.ndarray) -> Determined:
    """Fit ``columns`` (m, p) to ``measured`` (m,), and anew without each ``stretch`` (m,) int.

    In the basis U of the singular value decomposition the normal matrix is I, and that of a stretch UᵍᵀUᵍ.
    """
    scale = np.linalg.norm(columns, axis=0)
    scale[scale <= ROUNDING * scale.max()] = np.inf
    basis, size, turn = np.linalg.svd(columns / scale, full_matrices=False)
    rank = int(np.count_nonzero(size > RANK * size[0]))
    basis, back = basis[:, :rank], (turn[:rank] / size[:rank, None]).T / scale[:, None]
    whole = basis.T @ measured
    left_out = []
    for each in np.unique(stretch):
        part = basis[stretch == each]
        left_out.append(
            # least squares: a stretch that alone determines a coefficient leaves a singular matrix behind
            np.linalg.lstsq(np.eye(rank) - part.T @ part, whole - part.T @ measured[stretch == each])[0]
        )
    return Determined(back @ whole, np.array(left_out) @ back.T, turn[:rank], scale, size[:rank])
