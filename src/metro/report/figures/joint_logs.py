"""Joints of an arm that moves freely: friction by speed, and what a load adds to their torques."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from metro.report import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ACROSS = 3


def friction(curve: pd.DataFrame, table: pd.DataFrame) -> Figure:
    """Draw the friction of each joint over its speed, in bins, and the line of Coulomb and viscous friction.

    Without the constant part, which is weight as much as an error of the zero. Where a motion does not
    determine Coulomb friction, how the torque divides into friction and weight is open: nothing is drawn.

    Parameters
    ----------
    curve : rows of ``joint_log_curve`` of one run. table : of ``joint_log`` of it.
    """
    unit = str(table["unit"].iloc[0])
    with style.style():
        figure, places = _grid(sorted(curve["joint"].unique()))
        for axes, joint in places:
            part = curve[curve["joint"] == joint].sort_values("speed_deg_s")
            row = table[table["joint"] == joint].iloc[0]
            axes.set_title(f"joint {joint}", loc="left")
            speed = part["speed_deg_s"].to_numpy(float)
            offset, level, slope = (float(row[n]) for n in ("offset", "coulomb", "viscous"))
            if not np.isfinite(level):
                axes.text(0.5, 0.5, "not determined", ha="center", va="center", transform=axes.transAxes)
                axes.set(xticks=[], yticks=[])
                continue
            offset, slope = np.nan_to_num([offset, slope]).tolist()
            axes.errorbar(
                speed,
                part["friction"] - offset,
                part["sd"],
                fmt="o",
                ms=2.5,
                color=style.MEASURED,
                elinewidth=0.6,
                label="measured",
            )
            line = level * np.sign(speed) + slope * np.radians(speed)
            for way in (speed < 0, speed > 0):
                if way.any():
                    label = "Coulomb and viscous" if way[0] else None
                    axes.plot(speed[way], line[way], color=style.AFTER, label=label)
        _name(figure, places, "speed (°/s)", f"friction ({unit})")
    return figure


def load(course: pd.DataFrame) -> Figure:
    """Draw what the load adds to the torque of each joint along the motion: measured, and of the load found.

    Parameters
    ----------
    course : rows of ``payload_course``.
    """
    with style.style():
        figure, places = _grid(sorted(course["joint"].unique()))
        for axes, joint in places:
            part = course[course["joint"] == joint]
            axes.plot(
                100.0 * part["place"], part["measured_nm"], color=style.MEASURED, label="measured", lw=0.8
            )
            axes.plot(100.0 * part["place"], part["load_nm"], color=style.AFTER, label="of the load", lw=0.8)
            axes.set_title(f"joint {joint}", loc="left")
        _name(figure, places, "share of the motion (%)", "torque (N m)")
    return figure


def _grid(joints: list[int]) -> tuple[Figure, list[tuple[Axes, int]]]:
    rows = -(-len(joints) // ACROSS)
    figure, grid = style.new_figure(0.3 + 0.95 * rows, rows, ACROSS)
    flat = [axes for row in grid for axes in row]
    for axes in flat[len(joints) :]:
        axes.set_visible(False)
    return figure, list(zip(flat, joints, strict=False))


def _name(figure: Figure, places: list[tuple[Axes, int]], below: str, left: str) -> None:
    for axes in _last(places):
        axes.set_xlabel(below)
    figure.supylabel(left, fontsize="medium")
    named = next((axes for axes, _ in places if axes.get_legend_handles_labels()[1]), None)
    if named:
        style.legend_above(figure, named)


def _last(places: list[tuple[Axes, int]]) -> Iterator[Axes]:
    for axes, _ in places[-ACROSS:]:
        yield axes
