"""Deviations along a path, measured and predicted: point by point, absolute, arithmetic and geometric."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from metro.report import style
from metro.surface.along_path import ERRORS, errors_along
from metro.units import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOOKS = ((style.MEASURED, "-", "."), (style.BEFORE, "--", ""), (style.AFTER, "-.", ""))


def along(
    place: Sequence[float] | Array, curves: Mapping[str, Array], step: float, words: tuple[str, str]
) -> Figure:
    """Draw deviations over a path in four panels.

    Parameters
    ----------
    place : (n,) of the points. curves : by name deviations (n,), the measured ones first.
    step : rounding of the deviations. words : labels of the place, and of the unit of deviations.
    """
    along_label, unit = words
    panels = {name: {"deviation": d, **errors_along(d, step)} for name, d in curves.items()}
    titles = {"deviation": "deviation", **{name: f"{name} error" for name in ERRORS}}
    with style.style():
        figure, grid = style.new_figure(3.6, 2, 2, sharex=True)
        for axes, (kind, title) in zip([axes for row in grid for axes in row], titles.items(), strict=True):
            for (name, of), (colour, line, mark) in zip(panels.items(), LOOKS, strict=False):
                axes.plot(place, of[kind], line, color=colour, marker=mark, ms=3, lw=1.0, label=name)
            if kind == "deviation":
                axes.axhline(0.0, color=style.GREY, lw=0.6)
            else:
                axes.set_ylim(bottom=0.0)
            axes.set_title(title, loc="left")
        for row in grid:
            row[0].set_ylabel(unit)
        for axes in grid[-1]:
            axes.set_xlabel(along_label)
        style.legend_above(figure, grid[0][0])
    return figure
