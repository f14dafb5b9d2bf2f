"""Charts of a modal test at several positions and points: modes over positions, errors over distance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from metro.report import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NORMAL = 1.96
SHIFT = 0.08  # of the marks of one position, so that their intervals do not cover each other


def over_positions(modes: pd.DataFrame, properties: Sequence[tuple[str, str, str, float]]) -> Figure:
    """Draw how each mode differs from its mean over the positions, a row per direction.

    Parameters
    ----------
    modes : ``position, direction, mode`` and the columns of ``properties`` with their standard deviations.
    properties : column, column of the standard deviation, name, factor.
    """
    directions = list(dict.fromkeys(modes["direction"]))
    positions = [str(position) for position in dict.fromkeys(modes["position"])]
    with style.style():
        figure, grid = style.new_figure(
            0.4 + 1.5 * len(directions), len(directions), len(properties), sharex=True
        )
        for row, direction in zip(grid, directions, strict=True):
            part = modes[modes["direction"] == direction]
            names = sorted(part["mode"].unique())
            for axes, (column, sd, label, _) in zip(row, properties, strict=True):
                for k, name in enumerate(names):
                    one = part[part["mode"] == name]
                    at = [positions.index(str(p)) + SHIFT * (k - len(names) / 2) for p in one["position"]]
                    mean = one[column].mean()
                    change = 100.0 * (one[column] / mean - 1.0)
                    axes.errorbar(
                        at,
                        change,
                        NORMAL * 100.0 * one[sd] / mean,
                        fmt="o-",
                        ms=2.5,
                        lw=0.8,
                        elinewidth=0.7,
                        color=style.SERIES[k % len(style.SERIES)],
                        label=f"mode {name[len(str(direction).lstrip('+-')) :]}",
                    )
                axes.axhline(0.0, color=style.GREY, lw=0.6, zorder=0)
                axes.set_title(f"{direction}, {label.split(' (')[0]}", loc="left")
                axes.set_xticks(range(len(positions)), positions)
            row[0].set_ylabel("from the mean (%)")
        for axes in grid[-1]:
            axes.set_xlabel("position")
        style.legend_of(figure, (row[0] for row in grid))
    return figure


def by_distance(pickups: pd.DataFrame) -> Figure:
    """Draw the error of reconstruction of each response over its distance from the blow, by direction.

    Parameters
    ----------
    pickups : ``position, direction, distance_mm, error, noise``.
    """
    directions = list(dict.fromkeys(pickups["direction"]))
    positions = list(dict.fromkeys(pickups["position"]))
    with style.style():
        figure, [row] = style.new_figure(2.0, 1, len(directions), sharey=True)
        for axes, direction in zip(row, directions, strict=True):
            part = pickups[pickups["direction"] == direction].sort_values("distance_mm")
            for k, position in enumerate(positions):
                one = part[part["position"] == position]
                colour = style.SERIES[k % len(style.SERIES)]
                axes.semilogy(
                    one["distance_mm"],
                    100.0 * one["error"],
                    "o-",
                    ms=3,
                    lw=0.8,
                    color=colour,
                    label=f"position {position}",
                )
            middle = 100.0 * part.groupby("distance_mm")["noise"].median()
            if np.isfinite(middle).all():
                axes.semilogy(middle.index, middle, color=style.GREY, ls="--", label="scatter of the hits")
            axes.set_title(f"direction {direction}", loc="left")
            axes.set_xlabel("distance from the blow (mm)")
            axes.set_yticks([1, 2, 5, 10, 20, 50], ["1", "2", "5", "10", "20", "50"])
            axes.minorticks_off()
        row[0].set_ylabel("error of the modes (%)")
        handles, labels = row[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4)
    return figure
