"""The block ``areal`` of identified.json: S parameters of each scan that is a raster, with intervals."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.observables.quantity import quantity
from metro.surface.areal_parameters import Raster, areal_parameters, raster_of, scale_limited
from metro.units import JSON, MM, UM, Array

POINTS = ("x_mm", "y_mm", "z_mm")
UNITS = {"sk": ("1", 1.0), "ku": ("1", 1.0), "dq": ("1", 1.0), "dr": ("1", 1.0), "tr": ("1", 1.0)}
PITCHES = 5.0  # of the raster in the nesting index of the S-filter, where none is declared
MOST = 4_000_000  # points: the autocorrelation of more takes more memory than a job has
DRAWS = 8  # of the noise
RECTANGLE = np.sqrt(3.0)
TILES = 3  # along either side: parts of the surface, for what another place of it may give
OF_PLACE = ("a", "q", "sk", "ku", "dq", "dr")  # means over the surface; extremes grow with it
Values = dict[str, float]


def areal(batch: Batch, read: Tables) -> JSON:
    """Return the block ``areal``; {} for a batch without scans that are rasters.

    By run: a, q, sk, ku, p, v, z, dq, dr, al, tr, each with ``sources`` of its uncertainty; ``made`` (how),
    ``nesting_index_mm``, ``spacing_um``, ``rows``, ``columns``, ``missing`` (points without a height).
    """
    blocks: JSON = {}
    missing: dict[str, str] = {}
    for run in batch.with_files("scan"):
        points = read("scan", run)[[*POINTS]].to_numpy(dtype=float) * MM
        if not 64 <= len(points) <= MOST:
            continue
        raster = raster_of(points)
        if raster is None:
            continue
        try:
            blocks[run] = _of_raster(batch, raster)
        except ValueError as reason:
            missing[run] = str(reason)
    if missing:
        blocks["not_identified"] = missing
    return {"areal": blocks} if blocks else {}


def _of_raster(batch: Batch, raster: Raster) -> JSON:
    declared = batch.instrument("scanner")
    least = PITCHES * max(raster.spacing)
    index = float(declared["nesting_index_mm"]) * MM if "nesting_index_mm" in declared else least
    if index < 3.0 * max(raster.spacing):
        raise ValueError(
            f"scanner.nesting_index_mm = {index / MM:g} is less than three distances of the points "
            f"({max(raster.spacing) / MM:.3g} mm)"
        )
    surface = scale_limited(raster, index)
    values = areal_parameters(surface, raster.spacing)
    sources: dict[str, Values] = {"place": _by_place(surface, raster.spacing)}
    noise = float(declared.get("sigma_mm", 0.0)) * MM
    if noise:
        sources["noise"] = _by_noise(raster, index, noise, values)
    block: JSON = {name: _json(name, value, sources) for name, value in values.items() if np.isfinite(value)}
    dy, dx = raster.spacing
    made = f"plane taken out, S-filter of nesting index {index / MM:.4g} mm, no L-filter"
    lacking = (
        []
        if noise
        else ["the intervals do not cover the noise of the scanner, since scanner.sigma_mm is not declared"]
    )
    unknown = [name for name in ("al", "tr") if not np.isfinite(values[name])]
    if unknown:
        named = " and ".join(f"S{name}" for name in unknown)
        lacking.append(f"no {named}: the autocorrelation does not fall to 0.2 within half of the surface")
    return block | {
        "made": made,
        "nesting_index_mm": index / MM,
        "spacing_um": [dx / UM, dy / UM],
        "rows": raster.z.shape[0],
        "columns": raster.z.shape[1],
        "missing": int(np.isnan(raster.z).sum()),
        "remarks": lacking,
    }


def _by_place(surface: Array, spacing: tuple[float, float]) -> Values:
    """Return the standard errors of the mean over the tiles of a surface."""
    tiles = [tile for band in np.array_split(surface, TILES) for tile in np.array_split(band, TILES, axis=1)]
    level = np.nanmean(surface)
    found: dict[str, list[float]] = {name: [] for name in OF_PLACE}
    for tile in tiles:
        known = tile[np.isfinite(tile)] - level
        if len(known) < 64 or not np.ptp(known):
            continue
        gradient = np.gradient(tile, *spacing)
        square = gradient[0] ** 2 + gradient[1] ** 2
        found["a"].append(float(np.abs(known).mean()))
        found["q"].append(float(np.sqrt(np.mean(known**2))))
        found["sk"].append(float(np.mean(known**3) / np.mean(known**2) ** 1.5))
        found["ku"].append(float(np.mean(known**4) / np.mean(known**2) ** 2))
        found["dq"].append(float(np.sqrt(np.nanmean(square))))
        found["dr"].append(float(np.nanmean(np.sqrt(1.0 + square) - 1.0)))
    enough = {name: np.array(each) for name, each in found.items() if len(each) > 2}
    return {name: float(each.std(ddof=1) / np.sqrt(len(each))) for name, each in enough.items()}


def _by_noise(raster: Raster, index: float, noise: float, values: Values) -> Values:
    """Return what more noise does: its spread, and its mean change as a bias of unknown share."""
    random = np.random.default_rng(0)
    draws = []
    for _ in range(DRAWS):
        louder = Raster(raster.z + noise * random.standard_normal(raster.z.shape), raster.spacing)
        draws.append(areal_parameters(scale_limited(louder, index), raster.spacing))
    off = {name: np.array([draw[name] for draw in draws]) - value for name, value in values.items()}
    return {
        name: float(np.hypot(each.std(ddof=1), each.mean() / RECTANGLE))
        for name, each in off.items()
        if np.isfinite(each).all()
    }


def _json(name: str, value: float, sources: Mapping[str, Values]) -> JSON:
    unit, scale = UNITS.get(name, ("um", UM))
    parts = {source: found[name] / scale for source, found in sources.items() if name in found}
    if not parts:
        return quantity(value / scale, float("nan"), unit) | {"sources": {}}
    sd = float(np.sqrt(sum(part**2 for part in parts.values())))
    place = parts.get("place", 0.0)
    dof = (TILES**2 - 1) * (sd / place) ** 4 if place else float("inf")
    return quantity(value / scale, sd, unit, dof) | {"sources": parts}
