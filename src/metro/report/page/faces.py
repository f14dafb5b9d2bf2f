"""Machined faces, as data for the views that the page rotates."""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.report.figures.comparison import predictions
from metro.report.numbers import number
from metro.report.page.curves import run_option
from metro.report.page.packing import (
    Indices,
    decimals,
    fitting,
    left_out,
    notes,
    packed,
    rms_by_run,
)
from metro.report.results import Results
from metro.units import JSON, Array, printed

MOST = 100  # places of a face along either direction
MM = {"µm": 1e-3, "mm": 1.0}  # of a unit of height
SEEN = 0.98  # share of the heights within the scale of colours
HELP = (
    "Arrows: turn the face. Shift with an arrow: move the ring from place to place. End: the ring to the "
    "highest place. + and −: heights. Home: as it was. T: from above. Mouse or finger: drag to turn, point "
    "at a place to read it."
)


def face_maps(results: Results, budget: int) -> JSON | None:
    """Return the deviation of whole faces from their least-squares planes; None if none was scanned."""
    frame = results.tables.get("face_map")
    if frame is None:
        return None
    known = frame.dropna(subset=["deviation_um"])
    runs = [str(run) for run in known["run"].drop_duplicates()]
    limit = _limit(known["deviation_um"].to_numpy(float))
    faces, coarser = [], False
    for run in runs:
        mine = known[known["run"] == run]
        x, y, z = coarse(mine)
        coarser |= z.size < len(mine)
        layer = _layer("measured, less its plane", z.ravel(), mine["deviation_um"].to_numpy(float))
        places = {"x": packed(x), "y": packed(y)}
        faces.append({"key": [run], "said": run, "columns": len(x), **places, "layers": [layer]})
    spread = known.groupby(known["run"].astype(str))["deviation_um"].std().fillna(0.0)
    shown = fitting(faces, budget, [float(spread[run]) for run in runs])
    means = (
        f"each face is drawn by the means of up to {MOST} × {MOST} neighbourhoods, its extremes are of all "
        "places"
    )
    some = left_out(len(shown), len(runs), "faces", "the least flat")
    first = max(runs, key=lambda run: float(spread[run]))
    return {
        **_map("Faces, all runs", "µm", limit, shown),
        "first": [first],
        "note": notes(some, means * coarser),
    }


def point_maps(results: Results, budget: int) -> JSON | None:
    """Return held-out faces at the points of their paths: measured, predicted, and the residual."""
    frame = results.compared("flatness")
    if frame is None or frame[["x_mm", "y_mm"]].isna().any(axis=None):
        return None
    kinds = predictions(frame)
    frame = frame.assign(run=frame["run"].astype(str))
    runs = list(frame["run"].drop_duplicates())
    height = frame["measured"].to_numpy(float)
    limit = _limit(height - frame.groupby("run")["measured"].transform("mean").to_numpy(float))
    faces = []
    for run in runs:
        part = frame[frame["run"] == run]
        measured = part["measured"].to_numpy(float)
        half, middle = 1.96 * float(part["sigma"].median()), float(measured.mean())
        layers = [_layer("measured", measured, measured, half, middle)]
        for kind in kinds:
            predicted = part[kind.column].to_numpy(float)
            residual = measured - predicted
            layers += [
                _layer(f"predicted: {kind.label}", predicted, predicted, half, middle),
                _layer(f"residual, {kind.label}", residual, residual, half),
            ]
        places = {"x": packed(part["x_mm"].to_numpy(float)), "y": packed(part["y_mm"].to_numpy(float))}
        faces.append({"key": [run], "said": run, "columns": 0, **places, "layers": layers})
    names = frame["run"].to_numpy(str)
    rms = [rms_by_run(height - frame[kind.column].to_numpy(float), names) for kind in kinds]
    missed = rms[0]
    shown = fitting(faces, budget, [missed[run] for run in runs])
    some = left_out(len(shown), len(runs), "held-out faces", "those that the base model misses most")
    unit = printed(str(frame["unit"].iloc[0]))
    options = {run: run_option(run, [by_run[run] for by_run in rms], unit) for run in runs}
    drawn = _map("Held-out faces at the points of the path", unit, limit, shown)
    return {
        **drawn,
        "options": options,
        "first": [max(runs, key=lambda run: missed[run])],
        "note": notes(some),
    }


def coarse(part: pd.DataFrame) -> tuple[Array, Array, Array]:
    """Return places x (m,), y (n,) and heights (n, m) of a face, no more than 100 along either direction.

    A height is the mean of those measured in its neighbourhood, NaN if there is none.
    """
    column, x = _grouped(part["x_mm"].to_numpy(float))
    row, y = _grouped(part["y_mm"].to_numpy(float))
    place, size = row * len(x) + column, len(x) * len(y)
    count = np.bincount(place, minlength=size)
    total = np.bincount(place, weights=part["deviation_um"].to_numpy(float), minlength=size)
    z = np.divide(total, count, out=np.full(size, np.nan), where=count > 0)
    return x, y, z.reshape(len(y), len(x))


def _grouped(places: Array) -> tuple[Indices, Array]:
    """Return the neighbourhood of each place, and the middle of each neighbourhood."""
    values, which = np.unique(places, return_inverse=True)
    if len(values) <= MOST:
        return which, values
    edges = np.linspace(values[0], values[-1], MOST + 1)
    group = np.clip(np.searchsorted(edges, places, side="right") - 1, 0, MOST - 1)
    return group, (edges[1:] + edges[:-1]) / 2.0


def _limit(deviation: Array) -> float:
    """Return the deviation at which a scale of colours ends; few deviations exceed it."""
    return float(np.nanquantile(np.abs(deviation), SEEN)) or 1.0


def _layer(name: str, z: Array, all_of_it: Array, half: float = np.nan, middle: float = 0.0) -> JSON:
    """Return the drawn heights, and the extremes of all heights in words.

    The colours of the face alone end at ``middle`` ± ``limit``.
    """
    low, high = float(np.nanmin(all_of_it)), float(np.nanmax(all_of_it))
    limit = _limit(all_of_it - middle)
    extremes = f"from {number(low)} to {number(high)}"
    digits = decimals(half, limit)
    return {
        "name": name,
        "z": packed(z),
        "middle": middle,
        "limit": limit,
        "decimals": digits,
        "told": extremes,
    }


def _map(title: str, unit: str, limit: float, faces: list[JSON]) -> JSON:
    """Return a plot of faces; ``limit`` is that of the colours of all faces of the batch."""
    size = {"unit": unit, "mm": MM.get(unit, 1.0), "limit": limit}
    return {"kind": "map", "title": title, **size, "keys": ["run"], "curves": faces, "help": HELP}
