"""Modal identification: measured and reconstructed responses, stabilisation diagram, and mode shapes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from metro.report import style
from metro.report.numbers import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

DIAGRAMS = 4
MOST_SHAPES = 16
MODE_ROW = 0.16  # inches that the label of a mode takes


def responses(frf: pd.DataFrame) -> Figure:
    """Draw measured frequency responses and their modal reconstruction, magnitude over frequency.

    Parameters
    ----------
    frf : ``position, reference, response, frequency_hz, measured_m_n, modal_m_n`` (magnitudes), ``error``.
    """
    from matplotlib.ticker import NullFormatter

    pairs = list(frf.groupby(["position", "reference", "response"], sort=False))[:6]
    columns = min(2, len(pairs))
    with style.style():
        figure, grid = style.new_figure(
            0.6 + 1.7 * -(-len(pairs) // columns), -(-len(pairs) // columns), columns, sharex=True
        )
        flat = [axes for row in grid for axes in row]
        for axes, ((position, reference, response), part) in zip(flat, pairs, strict=False):
            thin = part.iloc[:: max(1, len(part) // 800)]
            axes.semilogy(
                thin["frequency_hz"], thin["measured_m_n"], color=style.MEASURED, lw=0.8, label="measured"
            )
            axes.semilogy(
                thin["frequency_hz"], thin["modal_m_n"], color=style.BEFORE, ls="--", label="modal model"
            )
            error = f" ({number(100.0 * part['error'].iloc[0], 2)} %)" if "error" in part else ""
            axes.set_title(f"position {position}: {reference} → {response}{error}", loc="left")
            axes.yaxis.set_minor_formatter(NullFormatter())
        for row in grid:
            row[0].set_ylabel("receptance (m/N)")
        for axes in flat[max(0, len(pairs) - columns) : len(pairs)]:
            axes.set_xlabel("frequency (Hz)")
            axes.xaxis.set_tick_params(labelbottom=True)
        for axes in flat[len(pairs) :]:
            axes.set_visible(False)
        style.legend_above(figure, flat[0])
    return figure


def stabilisation(diagram: pd.DataFrame, frf: pd.DataFrame) -> Figure:
    """Draw the poles of every model order over the sum of the measured responses, a panel per direction.

    Parameters
    ----------
    diagram : ``position, direction, order, frequency_hz, recurs``.
    frf : ``position, response, frequency_hz, measured_m_n``.
    """
    panels = list(diagram.groupby(["position", "direction"], sort=False))[:DIAGRAMS]
    with style.style():
        figure, grid = style.new_figure(0.5 + 1.7 * len(panels), len(panels))
        for (axes,), ((position, direction), poles) in zip(grid, panels, strict=True):
            here = frf[(frf["position"] == position) & frf["response"].str.endswith(str(direction))]
            total = here.groupby("frequency_hz")["measured_m_n"].sum()
            behind = axes.twinx()
            behind.semilogy(total.index, total, color=style.GREY, lw=0.8, label="sum of the responses")
            behind.set_ylabel("receptance (m/N)")
            behind.spines["right"].set_visible(True)
            behind.grid(visible=False)
            axes.set_zorder(behind.get_zorder() + 1)
            axes.patch.set_visible(False)
            for recurs, mark, colour, label in (
                (False, "x", style.BEFORE, "other pole"),
                (True, "o", style.AFTER, "recurring pole"),
            ):
                part = poles[poles["recurs"] == recurs]
                axes.plot(
                    part["frequency_hz"], part["order"], mark, color=colour, ms=3, mfc="none", label=label
                )
            axes.plot([], [], color=style.GREY, lw=0.8, label="sum of the responses")
            axes.set(xlim=(total.index.min(), total.index.max()), ylabel="model order")
            axes.set_ylim(0, 1.05 * float(np.max(poles["order"])))
            axes.set_title(f"position {position}, direction {direction}", loc="left")
        grid[-1][0].set_xlabel("frequency (Hz)")
        style.legend_above(figure, grid[0][0])
    return figure


def shapes(residues: pd.DataFrame, alike: pd.DataFrame) -> Figure:
    """Draw the shape of each mode over the points of one direction, and the MAC of every two modes.

    Parameters
    ----------
    residues : ``frequency_hz, point, real, imag, resolved``. alike : ``first_hz, second_hz, mac``.
    """
    from matplotlib.figure import Figure as Canvas

    panels = list(residues.groupby("frequency_hz", sort=True))[:MOST_SHAPES]
    points = list(residues["point"].unique())
    at = np.arange(len(points))
    with style.style():
        height = max(0.62 * -(-len(panels) // 4), MODE_ROW * alike["first_hz"].nunique())
        canvas = Canvas(figsize=(style.WIDTH, 0.7 + height), layout="constrained")
        halves: Any = canvas.subfigures(1, 2, width_ratios=[1.9, 1])
        left, right = halves
        grid = left.subplots(-(-len(panels) // 4), 4, squeeze=False, sharex=True, sharey=True)
        for axes, (_, part) in zip(grid.flat, panels, strict=False):
            value = part.set_index("point").loc[points]
            most = float(np.hypot(value["real"], value["imag"]).max())
            axes.axhline(0, color=style.GREY, lw=0.6)
            axes.plot(at, value["real"] / most, "o-", color=style.AFTER, ms=2.5, lw=0.9, label="in phase")
            axes.plot(at, value["imag"] / most, "x:", color=style.BEFORE, ms=3, lw=0.7, label="a quarter off")
            star = "" if value["resolved"].all() else " *"
            axes.set_title(
                f"{number(part['frequency_hz'].iloc[0], 4)} Hz{star}", loc="left", fontsize=8, pad=2
            )
            axes.set_xticks(at, points, fontsize=8)
            axes.set(ylim=(-1.15, 1.15))
            axes.tick_params(labelsize=8)
        for axes in grid.flat[len(panels) :]:
            axes.set_visible(False)
        left.supylabel("shape, largest 1", fontsize=9)
        handles, labels = grid.flat[0].get_legend_handles_labels()
        left.legend(handles, labels, loc="outside upper center", ncols=2)
        _alike(right, alike)
    return canvas


def _alike(part: SubFigure, alike: pd.DataFrame) -> None:
    matrix = alike.pivot_table(index="first_hz", columns="second_hz", values="mac")
    axes = part.subplots()
    image = axes.imshow(matrix, vmin=0, vmax=1, cmap=style.SEQUENTIAL, origin="lower")
    place = np.arange(len(matrix))
    names = [number(float(frequency), 4) for frequency in matrix.index]
    axes.set_xticks([])  # the order is that of the other axis
    axes.set_yticks(place, names, fontsize=8)
    axes.grid(visible=False)
    axes.set(ylabel="mode (Hz)", xlabel="the same modes")
    part.colorbar(image, ax=axes, location="right", label="MAC")
