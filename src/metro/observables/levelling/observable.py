"""Flatness of the faces of a batch by the slopes that a level or an autocollimator read."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.observables.quantity import quantity
from metro.surface.indices import Index
from metro.surface.level_indices import level_indices
from metro.surface.slope_noise import SlopeNoise, slope_noise, suspects
from metro.surface.slopes import Levelled, Readings, level
from metro.units import JSON, MM, UM, URAD, Array

FEW = 3  # readings that are named one by one


def observe(batch: Batch, read: Tables) -> tuple[dict[str, pd.DataFrame], JSON]:
    """Return the tables, and the block ``levelling`` of ``identified.json``; empty without slopes."""
    declared = float(batch.instrument("level").get("sigma_urad", math.nan)) * URAD
    block: JSON = {}
    reasons: JSON = {}
    tables: dict[str, list[pd.DataFrame]] = {"level_heights": [], "level_readings": []}
    for run in batch.with_files("slopes"):
        rows = read("slopes", run)
        readings = _readings(rows)
        try:
            found = level(readings)
        except ValueError as error:
            reasons[run] = str(error)
            continue
        noise = slope_noise(found, readings.slope, declared)
        block[run] = _block(found, readings, noise, declared)
        tables["level_heights"].append(_heights(run, found, noise))
        tables["level_readings"].append(_residuals(run, rows, found))
    block |= {"not_identified": reasons} if reasons else {}
    written = {name: pd.concat(parts, ignore_index=True) for name, parts in tables.items() if parts}
    return written, {"levelling": block} if block else {}


def _readings(rows: pd.DataFrame) -> Readings:
    first, second = (rows[[f"x{k}_mm", f"y{k}_mm"]].to_numpy(dtype=float) * MM for k in (1, 2))
    slope = rows["slope_urad"].to_numpy(dtype=float) * URAD
    return Readings(first, second, slope, rows["line"].to_numpy())


def _block(found: Levelled, readings: Readings, noise: SlopeNoise, declared: float) -> JSON:
    indices = level_indices(found, noise.sigma, noise.dof)
    sigma = {"value": noise.sigma / URAD if math.isfinite(noise.sigma) else None, "unit": "urad"}
    return {name: _index(index) for name, index in indices.items()} | {
        "slope_sigma": sigma | {"source": noise.source},
        "closure": {"value": found.scatter / URAD if found.dof else None, "unit": "urad"},
        "degrees_of_freedom": found.dof,
        "points": len(found.places),
        "readings": len(readings.slope),
        "lines": len(np.unique(readings.line)),
        "notes": [*_notes(found, noise, declared), *_wrong(found, readings)],
    }


def _index(index: Index) -> JSON:
    ends = [end / UM if math.isfinite(end) else None for end in (index.low, index.high)]
    return quantity(index.corrected / UM, math.nan, "um") | {"ci95": ends}


def _notes(found: Levelled, noise: SlopeNoise, declared: float) -> list[str]:
    """Say where the noise is from, and what it lacks."""
    if not noise.source:
        return [
            "no interval: the lines close no loop that would show the noise of a reading, and "
            "instruments.level.sigma_urad is not declared"
        ]
    if math.isfinite(declared) and noise.source != "declared standard deviation":
        return [
            f"the loops close worse than the declared {declared / URAD:.3g} µrad allow "
            f"({found.scatter / URAD:.3g} µrad by {found.dof} degrees of freedom): the larger figure is used"
        ]
    return []


def _wrong(found: Levelled, readings: Readings) -> list[str]:
    """Name the readings of which one is probably wrong."""
    which, chance = suspects(found)
    if not len(which):
        return []
    if len(which) <= FEW:
        named = " or ".join(
            f"reading {at + 1} (line {readings.line[at]}, residual {found.residuals[at] / URAD:.3g} µrad)"
            for at in which
        )
    else:
        lines = ", ".join(str(line) for line in np.unique(readings.line[which]))
        named = f"one of {len(which)} readings of lines {lines}"
    return [
        f"{named} does not agree with the others (probability by chance {chance:.2g}); it is used: "
        "read it again"
    ]


def _heights(run: str, found: Levelled, noise: SlopeNoise) -> pd.DataFrame:
    sd: Array = noise.sigma * np.sqrt(np.diag(found.cofactor))
    x, y = found.places.T / MM
    heights = {"z_um": found.heights / UM, "sigma_um": sd / UM}
    return pd.DataFrame({"run": run, "x_mm": x, "y_mm": y, **heights})


def _residuals(run: str, rows: pd.DataFrame, found: Levelled) -> pd.DataFrame:
    residual = {"residual_urad": found.residuals / URAD, "redundancy": found.redundancy}
    return rows.drop(columns="run").reset_index(drop=True).assign(run=run, **residual)
