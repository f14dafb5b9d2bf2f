"""Faces, drawn over a plane, and frequency responses."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from metro.report import style
from metro.report.figures.comparison import predictions
from metro.report.numbers import unit as shown_unit
from metro.units import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RUNS = 2


def face_points(frame: pd.DataFrame) -> Figure:
    """Draw deviations at path points: measured, and what is left by each prediction, one row per run.

    Parameters
    ----------
    frame : rows of comparison.parquet of flatness, with ``x_mm`` and ``y_mm``.
    """
    runs = [str(run) for run in frame["run"].drop_duplicates()][:RUNS]
    unit = shown_unit(str(frame["unit"].iloc[0]))
    kinds = predictions(frame)
    with style.style():
        figure, grid = style.new_figure(
            0.5 + 1.6 * len(runs), len(runs), 1 + len(kinds), sharex=True, sharey=True
        )
        for row, run in zip(grid, runs, strict=True):
            part = frame[frame["run"] == run]
            values = [part["measured"] - part["measured"].mean()]
            values += [part["measured"] - part[kind.column] for kind in kinds]
            limit = float(np.nanquantile(np.abs(np.array(values)), 0.99)) or 1.0
            titles = [f"{run}: measured, less its mean", *(f"left by: {kind.label}" for kind in kinds)]
            for axes, value, title in zip(row, values, titles, strict=True):
                dots = axes.scatter(
                    *(part["x_mm"], part["y_mm"]),
                    c=value,
                    s=9,
                    marker="s",
                    cmap=style.DIVERGING,
                    vmin=-limit,
                    vmax=limit,
                )
                axes.set_title(title, loc="left")
            row[0].set_ylabel("y (mm)")
            figure.colorbar(dots, ax=row, label=f"deviation ({unit})", fraction=0.03, pad=0.01)
        for axes in grid[-1]:
            axes.set_xlabel("x (mm)")
    return figure


def face_maps(frame: pd.DataFrame) -> Figure:
    """Draw the deviation of whole faces from their least-squares planes.

    Parameters
    ----------
    frame : ``face_map`` rows: ``run, x_mm, y_mm, deviation_um``.
    """
    runs = [str(run) for run in frame["run"].drop_duplicates()][: 3 * RUNS]
    rows = -(-len(runs) // 2)
    limit = float(np.nanquantile(np.abs(frame["deviation_um"]), 0.995)) or 1.0
    shape = float(np.ptp(frame["y_mm"]) / (np.ptp(frame["x_mm"]) or 1.0))
    with style.style():
        figure, grid = style.new_figure(0.3 + rows * (0.5 + 2.2 * min(max(shape, 0.2), 1.2)), rows, 2)
        flat = [axes for row in grid for axes in row]
        for axes, run in zip(flat, runs, strict=False):
            x, y, z = _raster(frame[frame["run"] == run])
            image = axes.pcolormesh(
                x, y, z, cmap=style.DIVERGING, vmin=-limit, vmax=limit, shading="nearest", rasterized=True
            )
            axes.set_title(run, loc="left")
            axes.set(xlabel="x (mm)", ylabel="y (mm)", aspect="equal")
            axes.grid(visible=False)
        for axes in flat[len(runs) :]:
            axes.set_visible(False)
        figure.colorbar(image, ax=flat[: len(runs)], label="deviation (µm)", fraction=0.04, pad=0.02)
    return figure


def _raster(part: pd.DataFrame) -> tuple[Array, Array, Array]:
    table = part.pivot_table(index="y_mm", columns="x_mm", values="deviation_um")
    return table.columns.to_numpy(float), table.index.to_numpy(float), table.to_numpy(float)
