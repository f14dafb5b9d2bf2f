"""Predicted and scanned faces: X_m and similarity, before and after the loop."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from metro.report.content import Item, Paragraph, Picture, Table
from metro.report.figures import face_pairing as figures
from metro.report.numbers import number
from metro.units import Array, printed

KINDS = ("measured", "before", "after")
LONGEST, DRAWS = 30, 200


def pairing_items(frame: pd.DataFrame) -> list[Item]:
    """Tabulate and draw, by held-out face, the measured and the predicted X_m at the compared points.

    ``frame``: rows of comparison.parquet of flatness.
    """
    faces = by_face(frame)
    if faces.empty:
        return []
    median = [float(faces[f"similar_{kind}"].median()) for kind in KINDS[1:]]
    shown = printed(str(frame["unit"].iloc[0]))
    text = (
        f"Similarity of X_m over {len(faces)} held-out faces, median: {number(median[0])} % by the base "
        f"model, {number(median[1])} % with what the loop found; similarity is 100 − |D_r| with "
        "D_r = (measured − predicted)/predicted, as FlePFaM tabulates it (57 to 97 % there)."
    )
    names = [
        *KINDS,
        *(f"{name}_{kind}" for kind in KINDS[1:] for name in ("similar", "of_measured", "point")),
    ]
    rows = [[str(r["run"]), *(number(float(r[c])) for c in names)] for _, r in faces.head(LONGEST).iterrows()]
    header = ["run", f"X_m ({shown})", "base model", "with effects"]
    header += [
        f"{word} {when}" for when in ("before", "after") for word in ("similar", "D_r/m", "D_r points")
    ]
    more = f" The first {LONGEST} of {len(faces)}." if len(faces) > LONGEST else ""
    caption = (
        "Range of heights about their plane (X_m) at the compared points, less what the scan's noise adds; "
        "similarity (%), D_r over the measured value (%), and median |D_r| of the points over the measured "
        f"deviation (%), before and after the loop.{more}"
    )
    about = (
        f"X_m of {len(faces)} held-out faces as predicted over as measured; median similarity "
        f"{number(median[1])} %."
    )
    return [
        Paragraph(text),
        Table(header, rows, caption, [0] * len(header), numeric=list(range(1, len(header))), small=True),
        Picture(figures.parity(faces, shown), about, about),
    ]


def by_face(frame: pd.DataFrame) -> pd.DataFrame:
    """Return a row per run: X_m measured, before, after; similarity and D_r in per cent."""
    placed = frame[frame[["x_mm", "y_mm"]].notna().all(axis=1)]
    rows = [_row(str(run), part) for run, part in placed.groupby("run", sort=False) if len(part) > 3]
    return pd.DataFrame(rows)


def _row(run: str, part: pd.DataFrame) -> dict[str, str | float]:
    place = part[["x_mm", "y_mm"]].to_numpy(float)
    heights = _about_plane(place, part[[*KINDS]].to_numpy(float))
    xm = dict(zip(KINDS, np.ptp(heights, axis=0).tolist(), strict=True))
    xm["measured"] -= _of_noise(place, heights[:, 2], _scatter(heights[:, 0] - heights[:, 2]))
    row: dict[str, str | float] = {"run": run, **xm}
    own = heights[:, 0]
    for column, kind in enumerate(KINDS[1:], start=1):
        apart = xm["measured"] - xm[kind]
        row[f"similar_{kind}"] = 100 * (1 - abs(apart) / xm[kind]) if xm[kind] > 0 else float("nan")
        row[f"of_measured_{kind}"] = 100 * apart / xm["measured"] if xm["measured"] > 0 else float("nan")
        known = np.abs(own) > 0
        share = np.abs((own - heights[:, column])[known] / own[known])
        row[f"point_{kind}"] = 100 * float(np.median(share)) if known.any() else float("nan")
    return row


def _scatter(residual: Array) -> float:
    """Return the scatter of measured heights from point to point, from second differences of the residual.

    The table's ``sigma`` also contains errors that a whole face shares (its place, the arm's stiffness); they
    add nothing to a range about a plane.
    """
    return 1.4826 * float(np.median(np.abs(np.diff(residual, 2)))) / math.sqrt(6.0)


def _of_noise(place: Array, surface: Array, sigma: float) -> float:
    """Return the mean increase, over draws, of a surface's range about its plane by noise of ``sigma``."""
    rng = np.random.default_rng(0)
    noisy = surface[:, None] + sigma * rng.standard_normal((len(surface), DRAWS))
    return float(np.ptp(_about_plane(place, noisy), axis=0).mean() - np.ptp(surface))


def _about_plane(place: Array, heights: Array) -> Array:
    """Return ``heights`` (n, k) less the least-squares plane of each over ``place`` (n, 2)."""
    across = np.column_stack([np.ones(len(place)), place - place.mean(axis=0)])
    return np.asarray(heights - across @ np.linalg.lstsq(across, heights, rcond=None)[0])
