"""Compliance of the tip at every point that was loaded, by its load tests alone."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.joint_columns import axes_of
from metro.observables.quantity import quantity
from metro.surface.tip_stiffness import PAIRS, PointCompliance, point_compliance
from metro.units import JSON, MM, UM, Array

FORCE, MOVED, PLACE = ["fx_n", "fy_n", "fz_n"], ["dx_mm", "dy_mm", "dz_mm"], ["x_mm", "y_mm", "z_mm"]


def observe(_batch: Batch, read: Tables) -> tuple[dict[str, pd.DataFrame], JSON]:
    """Return the table ``load_points``, and the block ``tip_compliance`` of identified.json.

    Of the block, pose → point → the entries of C (µm/N) that the tests at the point determine. The table has
    a row per point: tests, largest force, stiffness along each axis (force along it over the displacement
    along it, 1 / C_ii, the ends of its interval those of C_ii) and the scatter about the linear spring.
    """
    block: JSON = {}
    rows = []
    for pose, point, tests in _points(read("loads")):
        force = tests[FORCE].to_numpy(dtype=float)
        found = point_compliance(force, tests[MOVED].to_numpy(dtype=float) * MM)
        entries = _entries(found)
        block.setdefault(pose, {})[point] = entries
        row: JSON = {"pose": pose, "point": point, "tests": len(tests), "force_n": float(abs(force).max())}
        for axis in "xyz":
            row |= dict(zip(_columns(axis), _stiffness(entries.get(2 * axis)), strict=True))
        rows.append(row | {"scatter_um": found.residual_sd / UM})
    return ({"load_points": pd.DataFrame(rows)}, {"tip_compliance": block}) if rows else ({}, {})


def _columns(axis: str) -> tuple[str, str, str]:
    return f"k{axis}_n_um", f"k{axis}_low_n_um", f"k{axis}_high_n_um"


def _points(loads: pd.DataFrame) -> Iterator[tuple[str, str, pd.DataFrame]]:
    """Yield pose, point and tests of each loaded point.

    A pose without a name has that of its joints' places, a point without one that of its coordinates.
    """
    axes = axes_of(loads)
    pose, point = _named(loads, "pose", axes.positions), _named(loads, "point", PLACE)
    for (one, other), tests in loads.groupby([pose, point], sort=False):
        yield str(one), str(other), tests


def _named(loads: pd.DataFrame, column: str, places: Sequence[str]) -> pd.Series:
    """Return the names in a column; where one is blank, the numbers in the columns of places, rounded."""
    given = loads[column].fillna("").astype(str)
    return given.where(given != "", [_place(row) for row in loads[list(places)].to_numpy(dtype=float)])


def _place(numbers: Array) -> str:
    """Name a place by its coordinates, or by those of the joints; "" where they are not all known."""
    known = len(numbers) and np.isfinite(numbers).all()
    return f"({', '.join(f'{each:.0f}' for each in numbers)})" if known else ""


def _entries(found: PointCompliance) -> JSON:
    """Return the entries of a compliance that its tests determine, µm/N."""
    return {
        "xyz"[i] + "xyz"[j]: quantity(found.matrix[i, j] / UM, found.sd[i, j] / UM, "um/N", found.dof)
        for i, j in PAIRS
        if math.isfinite(found.matrix[i, j])
    }


def _stiffness(compliance: JSON | None) -> tuple[float, float, float]:
    """Return 1 / C_ii and its interval, N/µm; no interval where that of C_ii is none or holds zero."""
    if compliance is None or compliance["value"] <= 0.0:
        return math.nan, math.nan, math.nan
    low, high = compliance["ci95"]
    if low is None or low <= 0.0:
        return 1.0 / compliance["value"], math.nan, math.nan
    return 1.0 / compliance["value"], 1.0 / high, 1.0 / low
