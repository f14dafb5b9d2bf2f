"""Surface texture of the traces of a batch: P, W and R parameters of each, with their intervals."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.observables.quantity import quantity
from metro.surface.profile import ROUGHNESS_CUTOFF
from metro.surface.texture import UNITLESS, Parameter, Texture, by_repeats, parameters, stated, texture
from metro.units import JSON, MM, UM

PARAMETER_COLUMNS = ("run", "profile", "parameter", "value", "low", "high", "unit", "source", "notes")
ROUNDING = 1e-12
DRAWN = 1500  # points of a trace that a figure can show


def observe(batch: Batch, read: Tables) -> tuple[dict[str, pd.DataFrame], JSON]:
    """Return the tables, and the block ``texture`` of ``identified.json``; empty without traces."""
    runs = [str(run) for run in batch.with_files("profile")]
    parted = {run: _parted(batch, read("profile", run)) for run in runs}
    known = {run: each for run, each in parted.items() if isinstance(each, Texture)}
    rows = [row for run, each in known.items() for row in _rows(batch, run, each, known)]
    reasons = {run: each for run, each in parted.items() if isinstance(each, str)}
    block: JSON = {run: _block([row for row in rows if row[0] == run], known[run]) for run in known}
    block |= {"not_identified": reasons} if reasons else {}
    tables = {"profile_parameters": pd.DataFrame(rows, columns=[*PARAMETER_COLUMNS])}
    if known:
        tables["profile_traces"] = pd.concat([_trace(run, each) for run, each in known.items()])
    return {name: table for name, table in tables.items() if len(table)}, {"texture": block} if block else {}


def _parted(batch: Batch, trace: pd.DataFrame) -> Texture | str:
    cutoff = float(batch.instrument("profiler").get("roughness_cutoff_mm", ROUGHNESS_CUTOFF / MM)) * MM
    try:
        x, z = (trace[name].to_numpy(dtype=float) * MM for name in ("x_mm", "z_mm"))
        return texture(x, z, cutoff)
    except ValueError as error:
        return str(error)


def _rows(batch: Batch, run: str, one: Texture, known: dict[str, Texture]) -> Iterator[tuple[object, ...]]:
    """Yield the rows of a run: a parameter each, with its interval and what that is from."""
    noise = float(batch.instrument("profiler").get("sigma_mm", math.nan)) * MM
    same = [known[other] for other in repeats(batch, run) if other in known]
    notes = " ".join(one.notes)
    for profile in one.profiles:
        of = [each for other in same for each in other.profiles if each.letter == profile.letter]
        found = stated(profile, noise)
        if len(of) > 1:
            by = by_repeats([parameters(each) for each in of])
            found = {name: by(name, each.value) for name, each in found.items()}
        for name, each in found.items():
            yield (run, profile.letter, profile.letter + name, *_printed(name, each), each.source, notes)


def _printed(name: str, found: Parameter) -> tuple[float, float, float, str]:
    """Return value, ends and unit as they are written: lengths in µm."""
    si = 1.0 if name in UNITLESS else UM
    if abs(found.value / si) < ROUNDING:  # as the skewness of a symmetric wave
        found = replace(found, value=0.0)
    return found.value / si, found.low / si, found.high / si, "1" if name in UNITLESS else "um"


def repeats(batch: Batch, run: str) -> list[str]:
    """Return the runs whose profile is a trace of the same place as that of a run, itself included.

    As with scans: runs of one condition, of which no more than one was cut.
    """
    runs = batch.runs
    same = runs[(runs["profile"].fillna("") != "") & (runs["condition"] == runs.loc[run, "condition"])]
    cut = int((same["operation"].fillna("").astype(str) != "").sum())
    return [str(name) for name in same.index] if cut <= 1 else [run]


def _block(rows: list[tuple[object, ...]], one: Texture) -> JSON:
    block: JSON = {}
    for row in rows:
        _, _, name, value, low, high, unit, source, _ = row
        entry = quantity(float(str(value)), math.nan, str(unit))
        if math.isfinite(float(str(high))):
            entry |= {"ci95": [low, high], "interval": source}
        block[str(name)] = entry
    return block | {"notes": list(one.notes)}


def _trace(run: str, one: Texture) -> pd.DataFrame:
    """Return points of the trace to draw: the heights of P, and of W where there is one."""
    primary = one.profiles[0]
    chosen = np.unique(np.linspace(0, len(primary.x) - 1, DRAWN).astype(int))
    wavy = next((each for each in one.profiles if each.letter == "W"), None)
    w = np.full(len(chosen), np.nan)
    if wavy is not None:
        w = np.interp(primary.x[chosen], wavy.x, wavy.z, left=np.nan, right=np.nan)
    return pd.DataFrame(
        {"run": run, "x_mm": primary.x[chosen] / MM, "p_um": primary.z[chosen] / UM, "w_um": w / UM}
    )
