"""Faces, drawn over a plane."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from metro.report import style
from metro.report.figures.comparison import predictions
from metro.report.numbers import number
from metro.units import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RUNS = 2
IN_UM = {"mm": 1e3, "um": 1.0}
SHARE = 0.95  # of the points of a face lie within the scale of colours; the others are in its end colours
MAPS = 16
APART = 4.0  # points by which the numbers of two points are moved from each other


def face_points(frame: pd.DataFrame) -> Figure:
    """Draw deviations at path points: measured, and the residual of each prediction, one row per run.

    Parameters
    ----------
    frame : rows of comparison.parquet of flatness, with ``x_mm`` and ``y_mm``.
    """
    runs = [str(run) for run in frame["run"].drop_duplicates()][:RUNS]
    scale = IN_UM[str(frame["unit"].iloc[0])]
    kinds = predictions(frame)
    with style.style():
        figure, grid = style.new_figure(
            0.5 + 1.6 * len(runs), len(runs), 1 + len(kinds), sharex=True, sharey=True
        )
        for row, run in zip(grid, runs, strict=True):
            part = frame[frame["run"] == run]
            measured = part["measured"] * scale
            values = [measured - measured.mean()]
            values += [measured - part[kind.column] * scale for kind in kinds]
            limit = float(np.nanquantile(np.abs(np.array(values)), 0.99)) or 1.0
            titles = [f"{run}: measured, less its mean", *(f"residual, {kind.label}" for kind in kinds)]
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
            figure.colorbar(dots, ax=row, label="deviation (µm)", extend="both", fraction=0.03, pad=0.01)
        for axes in grid[-1]:
            axes.set_xlabel("x (mm)")
    return figure


def face_maps(frame: pd.DataFrame, contacts: pd.DataFrame | None = None) -> Figure:
    """Draw the deviation of whole faces from their least-squares planes, smaller if there are many faces.

    Parameters
    ----------
    frame : ``face_map`` rows: ``run, x_mm, y_mm, deviation_um``.
    contacts : ``face_contacts`` rows: ``run, side, x_mm, y_mm``, of the planes of the minimum zone.
    """
    runs = [str(run) for run in frame["run"].drop_duplicates()][:MAPS]
    columns = min(len(runs), 2 if len(runs) <= 4 else 4)
    rows = -(-len(runs) // columns)
    frame = frame[frame["run"].isin(runs)]
    # The median over the faces, so that a groove in one of them does not set the scale of all.
    limit = float(frame["deviation_um"].abs().groupby(frame["run"]).quantile(SHARE).median()) or 1.0
    shape = float(np.ptp(frame["y_mm"]) / (np.ptp(frame["x_mm"]) or 1.0))
    height = 0.45 + min(max(shape, 0.25), 1.2) * 4.8 / columns
    with style.style():
        figure, grid = style.new_figure(0.6 + rows * height, rows, columns, sharex=True, sharey=True)
        flat = [axes for row in grid for axes in row]
        for axes, run in zip(flat, runs, strict=False):
            x, y, z = _raster(frame[frame["run"] == run])
            image = axes.pcolormesh(
                x, y, z, cmap=style.DIVERGING, vmin=-limit, vmax=limit, shading="nearest", rasterized=True
            )
            _mark(axes, contacts, run)
            _extremes(axes, frame[frame["run"] == run])
            axes.set_title(run, loc="left")
            axes.set(aspect="equal")
            axes.grid(visible=False)
        for axes in flat[len(runs) :]:
            axes.set_visible(False)
        for row in grid:
            row[0].set_ylabel("y (mm)")
        for axes in flat[max(0, len(runs) - columns) : len(runs)]:
            axes.set_xlabel("x (mm)")
            axes.tick_params(labelbottom=True)
        figure.colorbar(
            image, ax=flat[: len(runs)], label="deviation (µm)", extend="both", fraction=0.03, pad=0.01
        )
    return figure


def _extremes(axes: Axes, part: pd.DataFrame) -> None:
    """Mark the highest and the lowest point of a face, with their deviations (µm)."""
    known = part[part["deviation_um"].notna()]
    middle = float(known["x_mm"].mean())
    ends = [known.nlargest(1, "deviation_um"), known.nsmallest(1, "deviation_um")]
    highest = max(float(end["y_mm"].iloc[0]) for end in ends)
    for end in ends:
        x, y, deviation = (float(end[name].iloc[0]) for name in ("x_mm", "y_mm", "deviation_um"))
        axes.plot(x, y, "+", ms=6, mew=1.0, color=style.MEASURED, clip_on=False)
        side = "right" if x > middle else "left"
        axes.annotate(
            f"{'+' if deviation > 0 else ''}{number(deviation, 2)}",
            (x, y),
            (-5 if side == "right" else 5, APART if y == highest else -APART),
            textcoords="offset points",
            ha=side,
            va="center",
            fontsize=8,
            bbox={"boxstyle": "round,pad=0.1", "facecolor": "white", "alpha": 0.7, "linewidth": 0},
        )


def _mark(axes: Axes, contacts: pd.DataFrame | None, run: str) -> None:
    """Mark the contacts of the minimum zone's planes: triangles up for the upper, down for the lower."""
    if contacts is None:
        return
    for side, marker in (("upper", "^"), ("lower", "v")):
        part = contacts[(contacts["run"] == run) & (contacts["side"] == side)]
        axes.plot(
            part["x_mm"], part["y_mm"], marker, ms=5, mfc="white", mec=style.MEASURED, mew=0.8, clip_on=False
        )


def _raster(part: pd.DataFrame) -> tuple[Array, Array, Array]:
    table = part.pivot_table(index="y_mm", columns="x_mm", values="deviation_um")
    return table.columns.to_numpy(float), table.index.to_numpy(float), table.to_numpy(float)
