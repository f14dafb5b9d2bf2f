"""Machined faces, as a page turns them round."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pandas as pd

from metro.report.figures.comparison import predictions
from metro.report.numbers import number
from metro.report.page.packing import decimals, fitting, left_out, notes, packed
from metro.report.results import Results
from metro.units import JSON, Array, printed

Indices = npt.NDArray[np.intp]

MOST = 50  # places of a face along either direction
HELP = (
    "Arrows: turn the face. Shift with an arrow: move the ring from place to place. + and −: heights. Home: "
    "as it was. T: from above. Mouse: drag to turn, point at a place to read it."
)


def face_maps(results: Results, budget: int) -> JSON | None:
    """Return the deviation of whole faces from their least-squares planes; None where none was scanned."""
    frame = results.tables.get("face_map")
    if frame is None:
        return None
    known = frame.dropna(subset=["deviation_um"])
    runs = [str(run) for run in known["run"].drop_duplicates()]
    faces, coarser = [], False
    for run in runs:
        x, y, z = coarse(known[known["run"] == run])
        coarser |= z.size < int((known["run"] == run).sum())
        layer = {"name": "measured, less its plane", **_layer(z.ravel())}
        faces.append({"key": [run], "columns": len(x), "x": packed(x), "y": packed(y), "layers": [layer]})
    spread = known.groupby(known["run"].astype(str))["deviation_um"].std().fillna(0.0)
    shown = fitting(faces, budget, [float(spread[run]) for run in runs])
    means = f"each face is drawn by the means of up to {MOST} × {MOST} neighbourhoods"
    some = left_out(len(shown), len(runs), "faces", "the least flat")
    return {**_map("Faces, all runs", "µm", shown), "note": notes(some, means * coarser)}


def point_maps(results: Results, budget: int) -> JSON | None:
    """Return held-out faces at the points of their paths: measured, predicted, and what is left over."""
    frame = results.compared("flatness")
    if frame is None or frame[["x_mm", "y_mm"]].isna().any(axis=None):
        return None
    kinds = predictions(frame)
    runs = [str(run) for run in frame["run"].drop_duplicates()]
    faces = []
    for run in runs:
        part = frame[frame["run"] == run]
        measured = part["measured"].to_numpy(float)
        half = 1.96 * float(part["sigma"].median())
        middle = float(measured.mean())
        limit = _limit(measured - middle)  # one scale of colours for all that is compared
        layers = [{"name": "measured", **_layer(measured, half, middle, limit)}]
        for kind in kinds:
            predicted = part[kind.column].to_numpy(float)
            layers += [
                {"name": f"predicted: {kind.label}", **_layer(predicted, half, middle, limit)},
                {"name": f"left by: {kind.label}", **_layer(measured - predicted, half, 0.0, limit)},
            ]
        places = {"x": packed(part["x_mm"].to_numpy(float)), "y": packed(part["y_mm"].to_numpy(float))}
        faces.append({"key": [run], "columns": 0, **places, "layers": layers})
    missed = (frame["measured"] - frame["before"]).abs().groupby(frame["run"].astype(str)).mean()
    shown = fitting(faces, budget, [float(missed[run]) for run in runs])
    some = left_out(len(shown), len(runs), "held-out faces", "those that the base model misses most")
    name = printed(str(frame["unit"].iloc[0]))
    return {**_map("Held-out faces at the points of the path", name, shown), "note": notes(some)}


def coarse(part: pd.DataFrame) -> tuple[Array, Array, Array]:
    """Return places x (m,), y (n,) and heights (n, m) of a face, no more than 50 along either direction.

    A height is the mean of those measured in its neighbourhood, NaN where there is none.
    """
    column, x = _grouped(part["x_mm"].to_numpy(float))
    row, y = _grouped(part["y_mm"].to_numpy(float))
    place, size = row * len(x) + column, len(x) * len(y)
    count = np.bincount(place, minlength=size)
    total = np.bincount(place, weights=part["deviation_um"].to_numpy(float), minlength=size)
    z = np.divide(total, count, out=np.full(size, np.nan), where=count > 0)
    return x, y, z.reshape(len(y), len(x))


def _grouped(places: Array) -> tuple[Indices, Array]:
    """Return for each place the neighbourhood that it is in, and the middle of each neighbourhood."""
    values, which = np.unique(places, return_inverse=True)
    if len(values) <= MOST:
        return which, values
    edges = np.linspace(values[0], values[-1], MOST + 1)
    group = np.clip(np.searchsorted(edges, places, side="right") - 1, 0, MOST - 1)
    return group, (edges[1:] + edges[:-1]) / 2.0


def _limit(z: Array) -> float:
    """Return the height at which a scale of colours that is even about zero ends."""
    return float(np.nanquantile(np.abs(z), 0.995)) or 1.0


def _layer(z: Array, half: float = np.nan, middle: float = 0.0, limit: float = 0.0) -> JSON:
    """Return heights, their scale of colours (``middle`` ± ``limit``), and the extremes in words."""
    known = z[np.isfinite(z)]
    limit = limit or _limit(known - middle)
    told = f"from {number(float(known.min()))} to {number(float(known.max()))}"
    return {"z": packed(z), "middle": middle, "limit": limit, "decimals": decimals(half, limit), "told": told}


def _map(title: str, name: str, faces: list[JSON]) -> JSON:
    return {"kind": "map", "title": title, "unit": name, "keys": ["run"], "curves": faces, "help": HELP}
