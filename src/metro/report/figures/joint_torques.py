"""The force from the joints' torques: logs brought together, torques by joint, which of them count."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from metro.report import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHADES = {"cut-in": 0.16, "cut-out": 0.16, "steady": 0.06}
LEVEL = 0.05  # of the whiteness test
NORMAL = 1.96


def courses(force: pd.DataFrame, means: pd.DataFrame, runs: Sequence[str]) -> Figure:
    """Draw the sensorless force along the wall with its 95 % band, and the dynamometer's steady mean.

    Parameters
    ----------
    force : rows of ``robot_force``. means : of ``robot_means``. runs : to draw.
    """
    columns = min(2, len(runs))
    rows = -(-len(runs) // columns)
    with style.style():
        figure, grid = style.new_figure(0.5 + 1.0 * rows, rows, columns)
        flat = [axes for row in grid for axes in row]
        for axes, run in zip(flat, runs, strict=False):
            _course(axes, force[force["run"] == run], means[means["run"] == run])
            axes.set_title(f"run {run}", loc="left")
            axes.set(xlabel="along the wall (mm)", ylabel="force (N)")
        for axes in flat[len(runs) :]:
            axes.set_visible(False)
        style.legend_above(figure, flat[0])
    return figure


def _course(axes: Axes, course: pd.DataFrame, means: pd.DataFrame) -> None:
    x, part = course["x_mm"].to_numpy(float), course["part"].to_numpy(str)
    for name, alpha in SHADES.items():
        inside = x[part == name]
        for piece in np.split(inside, np.flatnonzero(np.diff(inside) > 3 * np.median(np.diff(x))) + 1):
            if len(piece):
                axes.axvspan(piece[0], piece[-1], color=style.GREY, alpha=alpha, lw=0)
    steady = x[part == "steady"]
    for name, colour in style.AXES:
        value, sd = (course[f"{start}f{name}_n"].to_numpy(float) for start in ("", "sd_"))
        axes.fill_between(x, value - NORMAL * sd, value + NORMAL * sd, color=colour, alpha=0.25, lw=0)
        axes.plot(x, value, color=colour, label=f"{name}, from the torques")
        measured = means.loc[means["axis"] == name, "dynamometer_n"].to_numpy(float)
        if len(steady) and np.isfinite(measured).all() and len(measured):
            axes.hlines(
                measured,
                steady[0],
                steady[-1],
                color=style.MEASURED,
                ls="--",
                lw=0.9,
                zorder=3,
                label="dynamometer, steady mean" if name == "z" else "",
            )


def torques(together: pd.DataFrame, table: pd.DataFrame, joints: pd.DataFrame) -> Figure:
    """Draw a joint's torque by time and by place, and the torques of the cut beyond the idle run ([K] 2, 4).

    Parameters
    ----------
    together : ``robot_aligned``. table, joints : rows of ``robot_torques`` and ``robot_joints`` of that run.
    """
    with style.style():
        across = 1 + -(-table["joint"].nunique() // 2)
        figure, grid = style.new_figure(2.5, 2, across)
        for axes, (column, label) in zip(
            (grid[0][0], grid[1][0]), (("t_s", "time (s)"), ("x_mm", "along the wall (mm)")), strict=True
        ):
            for name, colour, text in (("cut", style.AFTER, "cut"), ("idle", style.GREY, "idle run")):
                part = together[together["log"] == name]
                axes.plot(part[column], part["torque_nm"], color=colour, lw=0.5, label=text)
            axes.set(xlabel=label, ylabel="torque (N m)")
            axes.set_title(f"joint {together['joint'].iloc[0]}, by {label.split()[0]}", loc="left")
        grid[1][0].set_title(f"joint {together['joint'].iloc[0]}, by place", loc="left")
        used = joints.set_index("joint")["used"]
        panels = [*grid[0][1:], *grid[1][1:]]
        for axes, (joint, part) in zip(panels, table.groupby("joint"), strict=False):
            axes.plot(part["x_mm"], part["bin_nm"], ".", ms=1.5, color=style.GREY, label="cut less idle run")
            low, high = (part["level_nm"] + side * NORMAL * part["level_sd_nm"] for side in (-1.0, 1.0))
            axes.fill_between(part["x_mm"], low, high, color=style.BEFORE, alpha=0.25, lw=0)
            axes.plot(part["x_mm"], part["level_nm"], color=style.BEFORE, lw=0.9, label="filtered")
            axes.set_title(f"joint {joint}" + ("" if used[joint] else ", not used"), loc="left")
        for axes in panels[table["joint"].nunique() :]:
            axes.set_visible(False)
        for axes in grid[1][1:]:
            axes.set_xlabel("along the wall (mm)")
        handles = [*grid[0][0].get_lines(), *panels[0].get_lines()]
        figure.legend(handles=handles, loc="outside upper center", ncols=4)
    return figure


def joints(table: pd.DataFrame, threshold: float) -> Figure:
    """Draw the observability index of the joints in all runs, and the p values of whiteness in order.

    Parameters
    ----------
    table : ``robot_joints``. threshold : of the index.
    """
    with style.style():
        figure, [row] = style.new_figure(1.6, 1, 2)
        for used, face, label in ((True, style.AFTER, "used"), (False, "none", "not used")):
            part = table[table["used"] == used]
            if len(part):
                shift = 0.05 * (part["run"].astype("category").cat.codes % 7 - 3)
                row[0].plot(
                    part["joint"] + shift,
                    part["index"].clip(lower=1e-3),
                    "o",
                    ms=3,
                    color=style.AFTER,
                    mfc=face,
                    label=label,
                )
        row[0].axhline(threshold, color=style.BEFORE, lw=0.9, ls="--", label="threshold of [K]")
        row[0].set_yscale("log")
        row[0].set(xlabel="joint", ylabel="observability index")
        p = np.sort(table["whiteness"].dropna().to_numpy(float))
        row[1].plot((np.arange(len(p)) + 0.5) / max(len(p), 1), p, "o", ms=2.5, color=style.AFTER)
        row[1].plot([0, 1], [0, 1], color=style.GREY, lw=0.8)
        row[1].axhline(LEVEL, color=style.BEFORE, lw=0.9, ls="--")
        handles, labels = row[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper left", ncols=3)
        row[1].set(xlabel="share of the records", ylabel="p of whiteness", xlim=(0, 1), ylim=(0, 1))
    return figure
