"""The path error of flange and tip: along the path, by joint, and its spectra."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from metro.report import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DOMAINS = (("time", "frequency (Hz)", "µm²/Hz"), ("path", "waves per mm", "µm² mm"))
LOGS = {"cut": (style.AFTER, "-", "cut"), "idle": (style.GREY, "--", "idle run")}


def tracking(course: pd.DataFrame, joint: int) -> Figure:
    """Draw the error of flange and tip across the feed, that of one joint alone, and its drive ([K] 9–11).

    Parameters
    ----------
    course : rows of ``robot_tracking`` of one run. joint : 1 … 6.
    """
    logs = dict(tuple(course.groupby("log")))
    cut = logs["cut"]
    with style.style():
        figure, grid = style.new_figure(2.8, 2, 2, sharex=True)
        for axes, what in zip(grid[0], ("flange", "tip"), strict=True):
            known = [name for name in LOGS if name in logs]
            for name in known:
                colour, look, label = LOGS[name]
                part = logs[name]
                axes.plot(part["x_mm"], part[f"{what}_um"], color=colour, ls=look, label=label)
            axes.set_title(f"{what}, {' and '.join(LOGS[name][2] for name in known)}", loc="left")
        grid[0][1].sharey(grid[0][0])
        _alone(grid[1][0], cut, joint)
        _drive(grid[1][1], cut, joint)
        for axes in (*grid[0], grid[1][0]):
            axes.set_ylabel("error (µm)")
        for axes in grid[1]:
            axes.set_xlabel("along the wall (mm)")
        style.legend_of(figure, (grid[0][0], grid[1][0]))
    return figure


def _alone(axes: Axes, cut: pd.DataFrame, joint: int) -> None:
    axes.plot(cut["x_mm"], cut["tip_um"], color=style.AFTER, label="all joints")
    axes.plot(cut["x_mm"], cut[f"joint{joint}_um"], color=style.BEFORE, ls="--", label=f"joint {joint} alone")
    axes.set_title("tip in the cut", loc="left")


def _drive(axes: Axes, cut: pd.DataFrame, joint: int) -> None:
    """Error of the joint and its torque on two scales; a line where it turns round."""
    axes.plot(cut["x_mm"], cut[f"error{joint}_urad"], color=style.BEFORE)
    axes.set_ylabel("error (µrad)", color=style.BEFORE)
    other = axes.twinx()
    other.plot(cut["x_mm"], cut[f"torque{joint}_nm"], color=style.GREEN, lw=0.9)
    other.set_ylabel("torque (N m)", color=style.GREEN)
    other.spines["right"].set_visible(True)
    other.grid(visible=False)
    rate, x = cut[f"rate{joint}_rad_s"].to_numpy(float), cut["x_mm"].to_numpy(float)
    for turn in np.flatnonzero(rate[1:] * rate[:-1] < 0.0):
        axes.axvline(0.5 * (x[turn] + x[turn + 1]), color=style.MEASURED, lw=0.7, ls=":")
    axes.set_title(f"joint {joint} in the cut: error and torque", loc="left")


def spectra(table: pd.DataFrame, lines: pd.DataFrame | None) -> Figure:
    """Draw the spectra of the tip's path error over time and along the path, all runs; mark the lines.

    Parameters
    ----------
    table : rows of ``robot_spectra``. lines : of ``robot_lines``; None if there are none.
    """
    domains = [domain for domain in DOMAINS if (table["domain"] == domain[0]).any()]
    with style.style():
        figure, [row] = style.new_figure(1.65, 1, len(domains))
        for axes, (domain, label, unit) in zip(row, domains, strict=True):
            part = table[table["domain"] == domain]
            for name, colour in style.AXES:
                for i, (_, one) in enumerate(part[part["axis"] == name].groupby("run", sort=False)):
                    axes.loglog(
                        one["frequency"],
                        one["density_um2"],
                        color=colour,
                        lw=0.5,
                        alpha=0.6,
                        label=name if i == 0 else None,
                    )
                if lines is not None:
                    marked = lines[(lines["domain"] == domain) & (lines["axis"] == name)]
                    height = np.full(len(marked), 2.0 * float(part["density_um2"].max()))
                    axes.plot(marked["frequency"], height, "v", color=colour, ms=4)
            axes.set(xlabel=label, ylabel=f"density ({unit})")
        style.legend_above(figure, row[0])
    return figure
