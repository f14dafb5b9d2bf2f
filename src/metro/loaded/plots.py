"""Figures on axes of matplotlib, in the report's style."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from metro.report import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from metro.loaded.force import ForcePrediction
    from metro.loaded.lobes import LobePrediction


HIGHEST = 4.0  # times the depth that nine speeds of ten do not exceed: lobes are drawn up to it


def axes_or_new(axes: Axes | None) -> Axes:
    """Return axes to draw on: those that are given, or the current ones of pyplot."""
    if axes is not None:
        return axes
    from matplotlib import pyplot as plt

    current: Axes = plt.gca()
    return current


def force_axes(predicted: ForcePrediction, axes: Axes | None) -> Axes:
    """Draw the components of a predicted force over the angle, with their intervals."""
    axes, table = axes_or_new(axes), predicted.table
    angle = table["angle_deg"]
    for name, colour in style.AXES:
        axes.fill_between(
            angle, table[f"f{name}_lo_n"], table[f"f{name}_hi_n"], color=colour, alpha=0.25, lw=0
        )
        axes.plot(angle, table[f"f{name}_n"], color=colour, label=name)
    axes.set(xlabel="spindle angle (°)", ylabel="force on the tool (N)", xlim=(0.0, 360.0))
    axes.legend()
    return axes


def lobe_axes(predicted: LobePrediction, axes: Axes | None) -> Axes:
    """Draw a stability boundary over the speed, with its band."""
    axes, table = axes_or_new(axes), predicted.table
    band = table["depth_lo_mm"], table["depth_hi_mm"]
    axes.fill_between(table["rpm"], *band, color=style.AFTER, alpha=0.22, lw=0, label="95 %")
    axes.plot(table["rpm"], table["depth_mm"], color=style.AFTER, label="boundary")
    axes.set(xlabel="spindle speed (rpm)", ylabel="axial depth (mm)")
    # The best lobe is among the highest; a pocket between two flips may be without end.
    highest = min(float(table["depth_mm"].max()), HIGHEST * float(table["depth_mm"].quantile(0.9)))
    axes.set_ylim(0.0, 1.08 * highest)
    axes.legend()
    return axes


def compared_axes(rows: pd.DataFrame, coordinate: str, label: str, axes: Axes | None) -> Axes:
    """Draw measured and predicted values of one run and axis over a coordinate, with the noise of both.

    Parameters
    ----------
    rows : of the comparison table; the first time block is drawn where there are several.
    """
    axes = axes_or_new(axes)
    x = rows[coordinate]
    axes.plot(x, rows["measured"], color=style.MEASURED, label="measured")
    axes.plot(x, rows["before"], color=style.BEFORE, ls="--", label="base model")
    axes.plot(x, rows["after"], color=style.AFTER, label="with effects")
    axes.set(xlabel=label, ylabel=f"{rows['observable'].iloc[0]} ({rows['unit'].iloc[0]})")
    axes.legend()
    return axes
