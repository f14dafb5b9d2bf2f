"""Errors point by point along a path, of printed pairs and of held-out faces ([F] figures 13 to 16)."""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.report.content import Item, Picture, Table
from metro.report.figures import along_path as figures
from metro.report.numbers import number
from metro.surface.along_path import WINDOW, errors_along, passes_of
from metro.surface.pairing import about_plane, indices_of, relative_deviation
from metro.units import Array, printed

FEWEST = 10
KINDS = {"measured": "measured", "before": "base model", "after": "with effects"}
HOW = (
    "Absolute: size of the deviation at the point; arithmetic and geometric: means of the sizes over "
    f"{WINDOW} points about it."
)


def printed_path(name: str, pairs: pd.DataFrame) -> list[Item]:
    """Write the errors along the points of a printed table of deviations; nothing for another table."""
    rows = pairs[(pairs["quantity"] == "deviation") & pairs["row"].str.fullmatch(r"\d+")]
    if len(rows) < FEWEST:
        return []
    measured, simulated = (rows[c].to_numpy(dtype=float) for c in ("measured", "predicted"))
    step = 10.0 ** -max(len(f"{v:.10g}".partition(".")[2]) for v in (*measured, *simulated))
    unit = printed(str(rows["unit"].iloc[0]))
    curves = {"measured": measured, "simulated": simulated}
    place = rows["row"].to_numpy(dtype=float)
    about = f"Table {name}, points {rows['row'].iloc[0]} to {rows['row'].iloc[-1]}"
    return [
        _summary(curves, step, unit, about),
        _picture(place, curves, step, ("point of the path", unit), about),
    ]


def face_path(frame: pd.DataFrame) -> list[Item]:
    """Write the errors along a line of points through the first held-out face of comparison.parquet.

    Of the lines along the feed, on the axis of a pass or beside it, it is the one nearest to the middle.
    """
    placed = frame[frame[["x_mm", "y_mm", "s_mm"]].notna().all(axis=1)]
    if placed.empty:
        return []
    run = str(placed["run"].iloc[0])
    face = placed[placed["run"] == run]
    place = face[["x_mm", "y_mm"]].to_numpy(dtype=float)
    lines = [rows for rows in passes_of(place) if len(rows) >= FEWEST]
    if not lines:
        return []
    off = [float(np.linalg.norm(place[rows].mean(axis=0) - place.mean(axis=0))) for rows in lines]
    rows = lines[int(np.argmin(off))]
    unit = printed(str(face["unit"].iloc[0]))
    x, y = place.T
    heights_of = {name: about_plane(x, y, face[kind].to_numpy(dtype=float)) for kind, name in KINDS.items()}
    curves = {name: heights[rows] for name, heights in heights_of.items()}
    if np.allclose(curves["base model"], curves["with effects"], rtol=1e-6, atol=0.0):
        del curves["with effects"]
    along = face["s_mm"].to_numpy(dtype=float)[rows]
    about = f"Run {run}, {len(rows)} compared points along the feed through the middle of the face"
    words = ("along the feed (mm)", unit)
    return [_summary(curves, 0.0, unit, about), _picture(along - along[0], curves, 0.0, words, about)]


def _summary(curves: dict[str, Array], step: float, unit: str, about: str) -> Table:
    """Tabulate the indices of the points, and the median |D_r| of the points by each kind of error."""
    (_, measured), *others = curves.items()
    rows = []
    for name, simulated in others:
        for place, (kind, index) in enumerate(
            (("absolute", "X_m"), ("arithmetic", "X_a"), ("geometric", "X_g"))
        ):
            pair = [float(indices_of(d, step)[place]) for d in (measured, simulated)]
            of_whole = [100 * float(part[0]) for part in relative_deviation(*(np.array([v]) for v in pair))]
            points = [errors_along(d, step)[kind] for d in (measured, simulated)]
            of_points = [100 * float(np.nanmedian(np.abs(part))) for part in relative_deviation(*points)]
            cells = [number(v) for v in (*pair, *of_whole, *of_points)]
            rows.append([f"{kind}, {index}" if len(others) == 1 else f"{name}: {kind}, {index}", *cells])
    header = [
        "error",
        f"measured ({unit})",
        "predicted",
        "D_r/m (%)",
        "D_r/p (%)",
        "points: |D_r|/m",
        "|D_r|/p",
    ]
    caption = (
        f"{about}: index over all points, measured and predicted, with D_r over the measured and over the "
        f"predicted value; and the median of |D_r| over the points. {HOW}"
    )
    return Table(
        header, rows, caption, [2.0, 1, 1, 0.9, 0.9, 1.1, 0.9], numeric=list(range(1, 7)), small=True
    )


def _picture(
    place: Array, curves: dict[str, Array], step: float, words: tuple[str, str], about: str
) -> Picture:
    (_, measured), *others = curves.items()
    name, simulated = others[-1]
    rms = float(np.sqrt(np.mean((measured - simulated) ** 2)))
    caption = (
        f"{about}: measured less {name} is {number(rms, 2)} {words[1]} (rms). Deviation point by point, and "
        f"its absolute, arithmetic and geometric error. {HOW}"
    )
    return Picture(figures.along(place, curves, step, words), caption, caption)
