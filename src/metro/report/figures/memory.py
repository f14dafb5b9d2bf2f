"""Figures of a campaign's memory: a parameter over the batches, with its course and the next batch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from metro.report import style
from metro.units import JSON, printed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CLOCKS = {"hours": "time since the first batch (h)", "days": "time since the first batch (days)"}
_ROOM = 44  # characters of a panel's title
_WIDE = 1.96


def courses(rows: Sequence[JSON], titles: Sequence[str]) -> Figure:
    """Draw each series with its errors, its course with a 95 % band, and the predicted next value.

    Parameters
    ----------
    rows : entries of ``series`` of ``memory.json``. titles : of the panels.
    """
    lines = -(-len(rows) // 2)
    with style.style():
        figure, grid = style.new_figure(0.5 + 1.9 * lines, lines, 2)
        panels = [axes for line in grid for axes in line]
        for axes, row, title in zip(panels, rows, titles, strict=False):
            _course(axes, row)
            axes.set_title(title if len(title) <= _ROOM else title[: _ROOM - 1] + "…", loc="left")
        for axes in panels[len(rows) :]:
            axes.set_visible(False)
        style.legend_above(figure, panels[0])
    return figure


def _course(axes: Axes, row: JSON) -> None:
    t, track = np.array(row["t"]), np.array(row["track"])
    axes.fill_between(t, track[:, 0], track[:, 2], color=style.AFTER, alpha=0.2, lw=0, label="course, 95 %")
    axes.plot(t, track[:, 1], color=style.AFTER)
    error = _WIDE * np.array(row["sd"])
    axes.errorbar(
        t, row["value"], error, fmt="o", ms=3.5, lw=0.8, color=style.MEASURED, label="batch", zorder=3
    )
    low, high = row["next"]["ci95"]
    middle = row["next"]["value"]
    axes.errorbar(
        [row["next"]["t"]],
        [middle],
        [[middle - low], [high - middle]],
        fmt="D",
        ms=4,
        lw=1.2,
        color=style.BEFORE,
        mfc="white",
        label="next batch, predicted",
        zorder=3,
    )
    axes.set_xlabel(CLOCKS.get(row["clock"], "batch, in the order of their names"))
    axes.set_ylabel(printed(row["unit"]))
