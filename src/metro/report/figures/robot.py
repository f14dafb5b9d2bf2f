"""The robot: stiffness around the work, friction of the joints, waviness of walls."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from metro.report import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RUNS = 2


def stiffness(chart: pd.DataFrame, ellipsoids: pd.DataFrame) -> Figure:
    """Draw the least stiffness over the work with its direction, and the stiffness ellipsoid from two sides.

    Parameters
    ----------
    chart : rows of ``arm_map``. ellipsoids : of ``arm_ellipsoids``; the first pose is drawn.
    """
    with style.style():
        figure, [row] = style.new_figure(2.05, 1, 3)
        _map(figure, row[0], chart)
        first = ellipsoids[ellipsoids["pose"] == ellipsoids["pose"].iloc[0]]
        for axes, seen in zip(row[1:], ((0, 1), (0, 2)), strict=True):
            _outline(axes, first, seen)
    return figure


def _map(figure: Figure, axes: Axes, chart: pd.DataFrame) -> None:
    x, y = np.unique(chart["x_mm"]), np.unique(chart["y_mm"])
    table = chart.sort_values(["x_mm", "y_mm"])
    value = table["k_least_n_um"].to_numpy(float).reshape(len(x), len(y)).T
    filled = axes.contourf(x, y, value, levels=12, cmap=style.SEQUENTIAL)
    bar = figure.colorbar(filled, ax=axes, location="bottom", shrink=0.9, pad=0.02)
    bar.set_label("least stiffness (N/µm)")
    bar.ax.locator_params(nbins=4)
    some = table[table["x_mm"].isin(x[1::3]) & table["y_mm"].isin(y[1::3])]
    axes.quiver(
        some["x_mm"],
        some["y_mm"],
        some["soft_x"],
        some["soft_y"],
        color="white",
        pivot="middle",
        headwidth=0,
        headlength=0,
        headaxislength=0,
        width=0.012,
        scale=9.0,
    )
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.set(xlabel="x (mm)", ylabel="y (mm)")


def stations(surface: pd.DataFrame, dots: pd.DataFrame) -> Figure:
    """Draw the end stiffness over slices of the workspace, a row per axis; dots are the slice's stations.

    The last row is the standard deviation of kriging.

    Parameters
    ----------
    surface : rows of ``end_surface``. dots : of ``end_stations``.
    """
    first, second, third = (f"{surface[name].iloc[0]}_mm" for name in ("first", "second", "third"))
    levels = list(surface["level_mm"].drop_duplicates())
    reach = 0.5 * min(np.diff(levels), default=math.inf)
    drawn = [(f"k{a}_n_um", f"k {a} (N/µm)") for a in "xyz"] + [("sd_percent", "standard deviation (%)")]
    with style.style():
        figure, grid = style.new_figure(
            0.5 + 1.15 * len(drawn), len(drawn), len(levels), sharex=True, sharey=True
        )
        for row, (column, label) in zip(grid, drawn, strict=True):
            steps = _steps(surface[column].to_numpy(float))
            for axes, level in zip(row, levels, strict=True):
                part = surface[surface["level_mm"] == level].sort_values([first, second])
                x, y = np.unique(part[first]), np.unique(part[second])
                value = part[column].to_numpy(float).reshape(len(x), len(y)).T
                filled = axes.contourf(x, y, value, levels=steps, cmap=style.SEQUENTIAL, extend="both")
                lines = axes.contour(x, y, value, levels=steps[1::2], colors="white", linewidths=0.5)
                axes.clabel(lines, fontsize=8)
                near = dots[(dots[third] - level).abs() < reach]
                axes.plot(near[first], near[second], "o", color=style.MEASURED, mfc="white", ms=2.5, mew=0.6)
                axes.grid(visible=False)
            bar = figure.colorbar(filled, ax=list(row), shrink=0.9, pad=0.01)
            bar.set_label(label)
            bar.ax.locator_params(nbins=4)
            row[0].set_ylabel(f"{second[0]} (mm)")
        for axes, level in zip(grid[0], levels, strict=True):
            axes.set_title(f"{third[0]} = {level:.0f} mm".replace("-", "−"), loc="left")
        for axes in grid[-1]:
            axes.set_xlabel(f"{first[0]} (mm)")
    return figure


def _steps(values: np.ndarray) -> np.ndarray:
    """Levels of contours at round numbers over the range of some values."""
    from matplotlib.ticker import MaxNLocator

    known = values[np.isfinite(values)]
    return np.asarray(MaxNLocator(10).tick_values(known.min(), known.max()))


def _outline(axes: Axes, pose: pd.DataFrame, seen: tuple[int, int]) -> None:
    """Outline of the ellipsoid in a view along the omitted axis: the image of a unit circle through P K."""
    vectors = pose[["axis_x", "axis_y", "axis_z"]].to_numpy(float).T
    matrix = (vectors * pose["stiffness_n_um"].to_numpy(float)) @ vectors.T
    left, size, _ = np.linalg.svd(matrix[list(seen)])
    angle = np.linspace(0, 2 * np.pi, 200)
    outline = left @ np.diag(size[:2]) @ np.stack([np.cos(angle), np.sin(angle)])
    axes.fill(*outline, color=style.SKY, alpha=0.35, lw=0)
    axes.plot(*outline, color=style.AFTER)
    for k in range(3):
        arm = pose["stiffness_n_um"].to_numpy(float)[k] * vectors[list(seen), k]
        axes.plot(*np.stack([-arm, arm], axis=1), color=style.MEASURED, lw=0.8)
    axes.set_aspect("equal", adjustable="datalim")
    names = "xyz"
    axes.set(xlabel=f"{names[seen[0]]} (N/µm)", ylabel=f"{names[seen[1]]} (N/µm)")


def friction(curve: pd.DataFrame, table: pd.DataFrame) -> Figure:
    """Draw the friction torque of each joint over its speed, and the identified line, if there is one.

    Parameters
    ----------
    curve : rows of ``joint_friction_curve``. table : of ``joint_friction``.
    """
    with style.style():
        figure, grid = style.new_figure(2.1, 2, 3)
        for axes, (_, joint) in zip([a for row in grid for a in row], table.iterrows(), strict=False):
            part = curve[curve["joint"] == joint["joint"]].sort_values("speed_deg_s")
            speed = part["speed_deg_s"].to_numpy(float)
            axes.errorbar(
                speed,
                part["friction_nm"],
                part["sd_nm"],
                fmt="o",
                ms=2.5,
                color=style.MEASURED,
                elinewidth=0.6,
                label="measured",
            )
            level = np.nan_to_num(float(joint["coulomb"])) * np.sign(speed)
            line = level + float(joint["viscous"]) * np.radians(speed)
            for way in (speed < 0, speed > 0):
                if way.any():
                    label = "Coulomb and viscous" if way[0] else None
                    axes.plot(speed[way], line[way], color=style.AFTER, label=label)
            axes.set_title(f"joint {joint['joint']}", loc="left")
        for axes in grid[-1]:
            axes.set_xlabel("speed (°/s)")
        for row in grid:
            row[0].set_ylabel("torque (N m)")
        style.legend_above(figure, grid[0][0])
    return figure


def waviness(waves: pd.DataFrame, runs: Sequence[str]) -> Figure:
    """Draw the waves of walls, and those of the tip's tracking error in the cut and in the idle run.

    Parameters
    ----------
    waves : rows of ``robot_waves``. runs : to draw.
    """
    drawn = (
        ("wall_um", style.MEASURED, "-", "wall, by the profiler"),
        ("tip_um", style.AFTER, "-", "tip in the cut, by the encoders"),
        ("idle_um", style.GREY, "--", "tip in the idle run"),
    )
    with style.style():
        columns = min(2, len(runs))
        rows = -(-len(runs) // columns)
        figure, grid = style.new_figure(0.5 + 0.95 * rows, rows, columns, sharey=True)
        flat = [axes for row in grid for axes in row]
        for axes, run in zip(flat, runs, strict=False):
            part = waves[waves["run"] == run]
            for column, colour, look, label in drawn:
                if part[column].notna().any():
                    axes.plot(part["x_mm"], part[column], color=colour, ls=look, lw=0.9, label=label)
            axes.set_title(f"run {run}", loc="left")
        for axes in flat[len(runs) :]:
            axes.set_visible(False)
        for axes in flat[max(0, len(runs) - columns) : len(runs)]:
            axes.set_xlabel("along the wall (mm)")
        figure.supylabel("height (µm)", fontsize="medium")
        style.legend_above(figure, flat[0])
    return figure
