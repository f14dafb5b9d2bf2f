"""How an arm yields at the tip, over a plate: solved at a grid of poses and interpolated."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from virtual_cell.arm import Arm
from virtual_cell.units import Array

_GRID = (5, 4)  # poses along work x, y


def tip_compliance(
    arm: Arm,
    origin: Array,
    axes: Array,
    size: tuple[float, float],
    near: Array,
    *,
    turn: Array | None = None,
) -> Callable[[Array], Array]:
    """Return the compliance (n, 3, 3), m/N, of the tip over points (n, 2), m, of a plate.

    Parameters
    ----------
    origin : (3,) of the plate's corner in the base, m. turn : (3, 3) axes of the plate in the base as
        columns, None: those of the base; the compliance is along the plate's axes.
    axes : (3, 3) of the tool in the base as columns. near : joint angles (6,), rad, to start from.

    Raises
    ------
    RuntimeError
        The arm does not reach a place.
    """
    from scipy.interpolate import RectBivariateSpline

    grid = [np.linspace(0.0, extent, n) for extent, n in zip(size, _GRID, strict=True)]
    compliance, turned = np.empty((*_GRID, 3, 3)), np.eye(3) if turn is None else turn
    q = near
    for i, x in enumerate(grid[0]):
        for j, y in enumerate(grid[1]):
            q = arm.reach(turned @ np.array([x, y, 0.0]) + origin, axes, q)
            compliance[i, j] = turned.T @ np.column_stack([arm.yields(q, unit) for unit in turned.T])
    splines = [
        RectBivariateSpline(*grid, compliance[:, :, i, j], kx=3, ky=3) for i in range(3) for j in range(3)
    ]
    return lambda points: np.stack([s.ev(*points.T) for s in splines], axis=-1).reshape(-1, 3, 3)
