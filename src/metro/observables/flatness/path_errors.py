"""Errors point by point along a path, of printed pairs and of a held-out face ([F] figures 13 to 16).

Tables ``path_errors`` (deviation, absolute, arithmetic and geometric error of each point, by curve) and
``path_indices`` (X_m, X_a, X_g of all points with D_r, and the median |D_r| of the points).
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.surface.along_path import errors_along, passes_of
from metro.surface.pairing import about_plane, indices_of, relative_deviation
from metro.units import Array

FEWEST = 10  # points that make a figure
KINDS = {"measured": "measured", "before": "base model", "after": "with effects"}
INDEX_OF = {"absolute": "X_m", "arithmetic": "X_a", "geometric": "X_g"}
Tables = dict[str, pd.DataFrame]


def path_errors(comparison: pd.DataFrame | None, printed: pd.DataFrame | None) -> Tables:
    """Return both tables; none where neither faces were compared nor deviations printed.

    Parameters
    ----------
    comparison : rows of comparison.parquet. printed : the observed table ``published_errors``.
    """
    parts = [part for part in (_of_printed(printed), _of_face(comparison)) if part]
    names = ("path_errors", "path_indices")
    return {name: pd.concat([part[name] for part in parts], ignore_index=True) for name in names if parts}


def _of_printed(table: pd.DataFrame | None) -> Tables:
    """Return the errors of the first printed table of deviations at numbered points."""
    if table is None:
        return {}
    rows = table[(table["quantity"] == "deviation") & table["row"].astype(str).str.fullmatch(r"\d+")]
    rows = rows[rows["predicted"].notna() & (rows["table"] == rows["table"].iloc[:1].squeeze())]
    if len(rows) < FEWEST:
        return {}
    curves = {"measured": rows["measured"].to_numpy(float), "simulated": rows["predicted"].to_numpy(float)}
    decimals = max(len(f"{v:.10g}".partition(".")[2]) for curve in curves.values() for v in curve)
    name = str(rows["table"].iloc[0])
    about = f"Table {name}, points {rows['row'].iloc[0]} to {rows['row'].iloc[-1]}"
    place, unit = rows["row"].to_numpy(dtype=float), str(rows["unit"].iloc[0])
    return _tables(
        curves, place, 10.0**-decimals, source=name, about=about, along="point of the path", unit=unit
    )


def _of_face(comparison: pd.DataFrame | None) -> Tables:
    """Return the errors along a line of compared points through the first held-out face.

    Of the lines along the feed, on the axis of a pass or beside it, it is the one nearest to the middle.
    """
    if comparison is None:
        return {}
    placed = comparison[(comparison["observable"] == "flatness") & comparison["measured"].notna()]
    placed = placed[placed[["x_mm", "y_mm", "s_mm", "before"]].notna().all(axis=1)]
    if placed.empty:
        return {}
    run = str(placed["run"].iloc[0])
    face = placed[placed["run"] == run].fillna({"after": placed["before"]})
    place = face[["x_mm", "y_mm"]].to_numpy(dtype=float)
    lines = [rows for rows in passes_of(place) if len(rows) >= FEWEST]
    if not lines:
        return {}
    off = [float(np.linalg.norm(place[rows].mean(axis=0) - place.mean(axis=0))) for rows in lines]
    rows = lines[int(np.argmin(off))]
    x, y = place.T
    heights = {name: about_plane(x, y, face[kind].to_numpy(dtype=float)) for kind, name in KINDS.items()}
    curves = {name: heights_of[rows] for name, heights_of in heights.items()}
    if np.allclose(curves["base model"], curves["with effects"], rtol=1e-6, atol=0.0):
        del curves["with effects"]
    along = face["s_mm"].to_numpy(dtype=float)[rows]
    about = f"Run {run}, {len(rows)} compared points along the feed through the middle of the face"
    unit = str(face["unit"].iloc[0])
    words = {"source": "faces", "about": about, "along": "along the feed (mm)", "unit": unit}
    return _tables(curves, along - along[0], 0.0, **words)


def _tables(
    curves: dict[str, Array], place: Array, step: float, *, source: str, about: str, along: str, unit: str
) -> Tables:
    head = {"source": source, "about": about, "along": along, "unit": unit}
    errors = [
        pd.DataFrame({**head, "curve": name, "place": place, "deviation": d, **errors_along(d, step)})
        for name, d in curves.items()
    ]
    measured, *others = curves
    rows = [
        {
            **head,
            "curve": name,
            "error": kind,
            "index": index,
            **_pair(curves[measured], curves[name], kind, step),
        }
        for name in others
        for kind, index in INDEX_OF.items()
    ]
    return {"path_errors": pd.concat(errors, ignore_index=True), "path_indices": pd.DataFrame(rows)}


def _pair(measured: Array, predicted: Array, kind: str, step: float) -> dict[str, float]:
    """Index of all points, measured and predicted, D_r of it, and the median |D_r| of the points, %."""
    place = list(INDEX_OF).index(kind)
    pair = [indices_of(d, step)[place : place + 1] for d in (measured, predicted)]
    points = [errors_along(d, step)[kind] for d in (measured, predicted)]
    whole = [100 * float(part[0]) for part in relative_deviation(pair[0], pair[1])]
    each = [100 * float(np.nanmedian(np.abs(part))) for part in relative_deviation(points[0], points[1])]
    return {
        "measured": float(pair[0][0]),
        "predicted": float(pair[1][0]),
        **dict(zip(("of_measured_percent", "of_predicted_percent"), whole, strict=True)),
        **dict(zip(("points_of_measured_percent", "points_of_predicted_percent"), each, strict=True)),
    }
