"""Deviations along a path, measured and predicted: point by point, absolute, arithmetic and geometric."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from metro.report import style
from metro.units import printed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOOKS = ((style.MEASURED, "-", "."), (style.BEFORE, "--", ""), (style.AFTER, "-.", ""))
PANELS = {
    "deviation": "deviation",
    "absolute": "absolute error",
    "arithmetic": "arithmetic error",
    "geometric": "geometric error",
}


def along(table: pd.DataFrame) -> Figure:
    """Draw deviations over a path in four panels.

    Parameters
    ----------
    table : rows of ``path_errors`` of one source, the measured curve first.
    """
    first = table.iloc[0]
    with style.style():
        figure, grid = style.new_figure(3.6, 2, 2, sharex=True)
        for axes, (kind, title) in zip([axes for row in grid for axes in row], PANELS.items(), strict=True):
            for (name, of), (colour, line, mark) in zip(
                table.groupby("curve", sort=False), LOOKS, strict=False
            ):
                axes.plot(
                    of["place"], of[kind], line, color=colour, marker=mark, ms=3, lw=1.0, label=str(name)
                )
            if kind == "deviation":
                axes.axhline(0.0, color=style.GREY, lw=0.6)
            else:
                axes.set_ylim(bottom=0.0)
            axes.set_title(title, loc="left")
        for row in grid:
            row[0].set_ylabel(printed(str(first["unit"])))
        for axes in grid[-1]:
            axes.set_xlabel(str(first["along"]))
        style.legend_above(figure, grid[0][0])
    return figure
