"""The struck tip: receptance and ring-down, measured and by M, C and K."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from metro.report import style
from metro.report.numbers import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def receptances(table: pd.DataFrame) -> Figure:
    """Draw the receptance of the tip, a panel per direction and a row per struck position.

    Parameters
    ----------
    table : ``position, axis, frequency_hz, measured_m_n, model_m_n, difference_percent``.
    """
    return _panels(table, ("frequency_hz", "measured_m_n", "model_m_n"), "frequency (Hz)", "m/N", log=True)


def ringing(table: pd.DataFrame) -> Figure:
    """Draw the acceleration of the tip after a blow, a panel per direction and a row per struck position.

    Parameters
    ----------
    table : ``position, axis, since_s, measured_m_s2, model_m_s2, difference_percent``.
    """
    return _panels(table, ("since_s", "measured_m_s2", "model_m_s2"), "time after the blow (s)", "m/s²")


def _panels(
    table: pd.DataFrame, columns: tuple[str, str, str], along: str, unit: str, *, log: bool = False
) -> Figure:
    positions, axes_of = table["position"].unique(), table["axis"].unique()
    with style.style():
        figure, grid = style.new_figure(
            0.5 + 1.4 * len(positions), len(positions), len(axes_of), sharex=True, sharey="row"
        )
        for row, position in zip(grid, positions, strict=True):
            for axes, axis in zip(row, axes_of, strict=True):
                part = table[(table["position"] == position) & (table["axis"] == axis)]
                if part.empty:
                    axes.set_visible(False)
                    continue
                x, measured, model = (part[name] for name in columns)
                axes.plot(x, measured, color=style.MEASURED, lw=0.8, label="measured")
                axes.plot(x, model, color=style.BEFORE, ls="--", lw=0.9, label="M, C, K")
                if log:
                    axes.set_yscale("log")
                off = number(part["difference_percent"].iloc[0], 2)
                axes.set_title(f"{position}, {axis} ({off} %)", loc="left")
            row[0].set_ylabel(unit)
        for axes in grid[-1]:
            axes.set_xlabel(along)
        style.legend_above(figure, grid[0][0])
    return figure
