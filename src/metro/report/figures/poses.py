"""Errors of measured poses: their distances, where in the workspace they are, curves of the joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from metro.report import style
from metro.units import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = (
    ("nominal", "nominal", style.GREY),
    ("geometry", "corrected", style.BEFORE),
    ("effects", "with effects", style.AFTER),
)
BINS = 80
CELLS = 24
OUTER = 0.002  # of the poses at each side that a map leaves out: one far away would make it small
GAP = 3.0  # steps between readings from which on a curve is interrupted


def _distance(errors: pd.DataFrame, stage: str) -> Array:
    """Return how far off poses are, (m,) mm: the length of the error, or the error of a measured distance."""
    columns = [name for axis in ("x", "y", "z", "distance") if (name := f"{stage}_{axis}_mm") in errors]
    return np.asarray(np.linalg.norm(np.nan_to_num(errors[columns].to_numpy(dtype=float)), axis=1))


def by_distance(errors: pd.DataFrame) -> bool:
    """Whether the errors of a series are those of distances; another series of the batch may have these."""
    return "distance_mm" in errors and bool(errors["distance_mm"].notna().any())


def distances(errors: pd.DataFrame) -> Figure:
    """Draw histograms of the distances; ``errors``: rows of ``pose_errors``."""
    with style.style():
        figure, ((axes,),) = style.new_figure(2.1)
        most = float(np.percentile(_distance(errors, "nominal"), 99.5)) or 1.0
        edges = list(np.linspace(0.0, most, BINS + 1))
        for stage, label, colour in SHOWN:
            values = _distance(errors, stage)
            axes.hist(
                np.clip(values, 0.0, most),
                edges,
                histtype="step",
                color=colour,
                lw=1.1,
                label=f"{label}, median {np.median(values):.2g} mm",
            )
        what = "distance" if by_distance(errors) else "position"
        axes.set_xlabel(f"difference between measured and predicted {what} (mm)")
        axes.set_ylabel("poses")
        axes.legend()
    return figure


def maps(errors: pd.DataFrame) -> Figure:
    """Draw the mean distance over two projections of the workspace, before and after."""
    with style.style():
        figure, grid = style.new_figure(3.9, 2, 2)
        for row, (first, second) in zip(grid, (("x", "y"), ("x", "z")), strict=True):
            for axes, (stage, label, _) in zip(row, (SHOWN[0], SHOWN[2]), strict=True):
                _map(figure, axes, errors, (first, second), stage)
                axes.set_title(label, loc="left")
    return figure


def _map(figure: Figure, axes: Axes, errors: pd.DataFrame, plane: tuple[str, str], stage: str) -> None:
    places = errors[[f"{axis}_mm" for axis in plane]]
    errors = errors[((places >= places.quantile(OUTER)) & (places <= places.quantile(1 - OUTER))).all(axis=1)]
    across, up = (errors[f"{axis}_mm"].to_numpy(dtype=float) for axis in plane)
    drawn = axes.hexbin(
        across,
        up,
        C=_distance(errors, stage),
        gridsize=int(np.clip(np.sqrt(len(errors)) / 2.0, 6, CELLS)),
        cmap=style.SEQUENTIAL,
        linewidths=0.1,
        mincnt=1,
    )
    cells = np.asarray(drawn.get_array(), dtype=float)
    drawn.set_clim(float(cells.min()), float(np.percentile(cells, 98)))
    axes.set_aspect("equal")
    axes.set_xlabel(f"{plane[0]} (mm)")
    axes.set_ylabel(f"{plane[1]} (mm)")
    figure.colorbar(drawn, ax=axes, label="mm", fraction=0.04, pad=0.01, extend="max")


def curves(table: pd.DataFrame) -> Figure:
    """Draw the curve of each joint with its 95 % interval; ``table``: rows of ``pose_curves`` of a run."""
    joints = list(dict.fromkeys(table["joint"]))
    with style.style():
        figure, grid = style.new_figure(0.3 + 0.85 * len(joints), len(joints), sharex=True)
        for (axes,), joint in zip(grid, joints, strict=True):
            own = table[table["joint"] == joint]
            reading, error, sigma = (
                own[name].to_numpy(dtype=float) for name in ("reading", "error", "sigma")
            )
            parts = np.flatnonzero(np.diff(reading) > GAP * float(np.min(np.diff(reading)))) + 1
            for piece in np.split(np.arange(len(reading)), parts):
                half = 1.96 * sigma[piece]
                axes.fill_between(reading[piece], error[piece] - half, error[piece] + half, color="0.8", lw=0)
                axes.plot(reading[piece], error[piece], color=style.AFTER, lw=0.9)
            unit = str(own["unit"].iloc[0])
            axes.set_ylabel(f"joint {joint} ({unit})")
            axes.set_xlabel("reading (mm)" if unit == "mm" else "reading (°)")
            axes.label_outer()
    return figure
