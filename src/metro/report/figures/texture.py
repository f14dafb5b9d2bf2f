"""Traces of profiles, with their waviness."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from metro.report import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST = 6


def traces(frame: pd.DataFrame) -> Figure:
    """Draw the P profile of each run and its W profile over it, one row per run; ``MOST`` runs."""
    runs = list(dict.fromkeys(frame["run"]))[:MOST]
    with style.style():
        figure, grid = style.new_figure(0.6 + 1.1 * len(runs), len(runs))
        for (axes,), run in zip(grid, runs, strict=True):
            part = frame[frame["run"] == run]
            axes.plot(part["x_mm"], part["p_um"], color="0.6", lw=0.6, label="P")
            if part["w_um"].notna().any():
                axes.plot(part["x_mm"], part["w_um"], color="C0", lw=1.2, label="W")
            axes.set_title(str(run), loc="left")
            axes.set_ylabel("z (µm)")
        grid[-1][0].set_xlabel("x (mm)")
        style.legend_above(figure, grid[0][0])
    return figure
