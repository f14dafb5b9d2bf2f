"""The heights of scans against the declared noise of the scanner, and against each other."""

from __future__ import annotations

import math

import numpy as np

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.slips.slip import Slip
from metro.units import Array

OBSERVABLES = ("flatness",)
POINTS = 4000  # of a scan, whose neighbours are looked at
NEIGHBOURS = 6
MEDIAN = 1.4826
SCALES = (10.0, 25.4, 100.0, 1000.0)  # cm for mm, inch for mm, dm, m
NEAR = 1.3  # factor within which the noise is that of a scale of the list
SAME = 1.5  # factor within which scans of one scanner agree


def scan_slips(batch: Batch, read: Tables) -> tuple[Slip, ...]:
    """State scans whose scatter is a scale of length times the scanner's, or that of the other scans.

    Where all scans agree with each other, a surface that is rough beside the scanner's noise scatters as
    well: only of a scan beside others that are as declared, or as each other, is a scale stated.
    """
    scatter = {run: _scatter(_points(read, run)) for run in batch.with_files("scan")}
    scatter = {run: value for run, value in scatter.items() if math.isfinite(value) and value > 0.0}
    if len(scatter) < 2:
        return ()
    usual = float(np.median(list(scatter.values())))
    off = {run: value / usual for run, value in scatter.items() if _scale(value / usual)}
    alike = sum(1 / SAME < value / usual < SAME for value in scatter.values())
    if not off or alike < len(scatter) - len(off) or alike < 2:
        return ()
    run, ratio = next(iter(off.items()))
    found = (
        f"the heights of the scan of {', '.join(off)} scatter {ratio:.3g} times as much from point to "
        f"point as those of the {alike} others ({1e3 * scatter[run]:.3g} µm against {1e3 * usual:.3g} µm)"
    )
    remedy = f"Likely: the z of {batch.runs['scan'][run]} is in another unit, a factor of {_scale(ratio):g}"
    return (Slip(OBSERVABLES, found, remedy, "runs.csv", "scan", run),)


def _scale(ratio: float) -> float:
    """Return the scale of length that a ratio is, or 0."""
    factor = max(ratio, 1.0 / ratio)
    return next((scale for scale in SCALES if 1 / NEAR < factor / scale < NEAR), 0.0)


def _points(read: Tables, run: str) -> Array:
    rows = read("scan", run)
    return rows[["x_mm", "y_mm", "z_mm"]].to_numpy(float)


def _scatter(points: Array) -> float:
    """Robust deviation, mm, of the height of points (n, 3) from the mean of their neighbours."""
    from scipy.spatial import cKDTree

    if len(points) < 4 * NEIGHBOURS:
        return math.nan
    chosen = points[:: max(1, len(points) // POINTS)]
    _, near = cKDTree(points[:, :2]).query(chosen[:, :2], NEIGHBOURS + 1)
    difference = chosen[:, 2] - points[near[:, 1:], 2].mean(axis=1)
    return float(MEDIAN * np.median(np.abs(difference)) / math.sqrt(1.0 + 1.0 / NEIGHBOURS))
