"""Faces that were levelled: heights of the stations, on the lines that were read."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from metro.report import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST = 4
WRITTEN = 60  # stations of a face up to which each height is written beside it


def levelled(heights: pd.DataFrame, readings: pd.DataFrame) -> Figure:
    """Draw each face from above, the stations in the colour of their heights; ``MOST`` runs.

    Parameters
    ----------
    heights : rows of ``level_heights``. readings : rows of ``level_readings``.
    """
    runs = list(dict.fromkeys(heights["run"]))[:MOST]
    with style.style():
        figure, grid = style.new_figure(0.3 + 3.0 * len(runs), len(runs))
        for (axes,), run in zip(grid, runs, strict=True):
            stations, read = heights[heights["run"] == run], readings[readings["run"] == run]
            ends = ([read[f"{axis}1_mm"], read[f"{axis}2_mm"]] for axis in "xy")
            axes.plot(*map(np.vstack, ends), color="0.8", lw=0.8)
            limit = float(stations["z_um"].abs().max()) or 1.0
            dots = axes.scatter(
                *(stations["x_mm"], stations["y_mm"]),
                c=stations["z_um"],
                s=18,
                cmap=style.DIVERGING,
                vmin=-limit,
                vmax=limit,
                edgecolors="0.4",
                linewidths=0.4,
                zorder=2,
            )
            extremes = {stations["z_um"].idxmax(), stations["z_um"].idxmin()}
            for at, row in stations.iterrows():
                if len(stations) <= WRITTEN or at in extremes:
                    text = f"{row['z_um']:.2g}".replace("-", "−")
                    place = (row["x_mm"], row["y_mm"])
                    axes.annotate(text, place, (3, 3), textcoords="offset points", fontsize=8)
            axes.set_aspect("equal")
            axes.margins(0.08)
            axes.set_title(str(run), loc="left")
            axes.set_ylabel("y (mm)")
            figure.colorbar(dots, ax=axes, label="height (µm)", fraction=0.03, pad=0.01)
        grid[-1][0].set_xlabel("x (mm)")
    return figure
