"""Cutting force: order spectra, the peaks of the teeth, and a helical cut over one orbit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from metro.report import style
from metro.report.figures.comparison import Prediction, predictions
from metro.units import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HARMONICS = 6
RUNS = 4
LEGEND_ROOM = 108  # characters; each entry needs six of them for its line
MARKS = ("o", "s", "^", "D", "v", "P", "X")
REVOLUTIONS = 2.0


def spectrum(orders: pd.DataFrame, teeth: int) -> Figure:
    """Draw the amplitudes of measured force and residuals over the orders of the spindle, a panel per axis.

    Parameters
    ----------
    orders : ``axis, order, measured, before, after``, N. teeth : ticks are at the tooth passing.
    """
    names = sorted(orders["axis"].unique())
    drawn = predictions(orders)
    with style.style():
        figure, (row,) = style.new_figure(1.45, 1, len(names), sharey=True)
        for axes, name in zip(row, names, strict=True):
            part = orders[(orders["axis"] == name) & (orders["order"] <= HARMONICS * teeth)]
            axes.bar(part["order"], part["measured"], 0.7, color=style.GREY, alpha=0.6, label="measured")
            for kind in drawn:
                axes.plot(
                    *(part["order"], part[kind.column]),
                    color=kind.colour,
                    ls=kind.line,
                    marker=kind.mark,
                    ms=3,
                    lw=0.7,
                    label=f"residual, {kind.label}",
                )
            axes.set_yscale("log")
            axes.set_xticks(np.arange(0, HARMONICS * teeth + 1, teeth))
            axes.set_title(name, loc="left")
            axes.set_xlabel("order of the spindle")
        largest = float(orders[["measured", "before"]].to_numpy().max())
        row[0].set_ylim(max(1e-4 * largest, _smallest(orders)), 2.0 * largest)
        row[0].set_ylabel("amplitude (N)")
        style.legend_above(figure, row[0])
    return figure


def _smallest(orders: pd.DataFrame) -> float:
    values = orders[["measured", "before", "after"]].to_numpy()
    return 0.7 * float(values[values > 0].min(initial=np.inf))


def tooth_peaks(metrics: pd.DataFrame) -> Figure:
    """Draw the peak of each tooth, measured and predicted with the 95 % interval of their difference.

    Parameters
    ----------
    metrics : rows of metric ``tooth_peak``: ``run, axis, model, tooth, measured, predicted, lo, hi``, N.
    """
    names = sorted(metrics["axis"].unique())
    runs = list(metrics["run"].drop_duplicates())[:RUNS]
    teeth = int(metrics["tooth"].max())
    place = {
        (run, tooth): i * (teeth + 1) + tooth for i, run in enumerate(runs) for tooth in range(1, teeth + 1)
    }
    drawn = predictions(_as_columns(metrics))
    with style.style():
        figure, (row,) = style.new_figure(1.45, 1, len(names))
        for axes, name in zip(row, names, strict=True):
            part = metrics[(metrics["axis"] == name) & metrics["run"].isin(runs)]
            _bars(axes, part, place, drawn)
            axes.set_title(name, loc="left")
            axes.set_xticks([(teeth + 1) * (i + 0.5) for i in range(len(runs))], runs)
            axes.grid(visible=False, axis="x")
        row[0].set_ylabel("largest magnitude (N)")
        style.legend_above(figure, row[0])
    return figure


def _as_columns(metrics: pd.DataFrame) -> pd.DataFrame:
    """Return the predictions before and after as columns."""
    columns = {model: part["predicted"].to_numpy(float) for model, part in metrics.groupby("model")}
    return pd.DataFrame(columns)


def _bars(
    axes: Axes, part: pd.DataFrame, place: dict[tuple[str, int], int], drawn: tuple[Prediction, ...]
) -> None:
    for i, kind in enumerate(drawn):
        rows = part[part["model"] == kind.column]
        at = np.array([place[run, tooth] for run, tooth in zip(rows["run"], rows["tooth"], strict=True)])
        if i == 0:
            axes.bar(at, rows["measured"], 0.85, color=style.GREY, alpha=0.6, label="measured")
        shift = 0.3 * (i - 0.5) if len(drawn) > 1 else 0.0
        half = 0.5 * (rows["hi"] - rows["lo"])
        axes.errorbar(
            *(at + shift, rows["predicted"]),
            yerr=half,
            fmt=kind.mark,
            color=kind.colour,
            ms=3.5,
            lw=0.9,
            label=kind.label,
        )


def orbit(forces: pd.DataFrame, spindle_rpm: float) -> Figure:
    """Draw a helical cut over one orbit, each axis: the band that a revolution spans, and two revolutions.

    Parameters
    ----------
    forces : ``t_s, fx_n, fy_n, fz_n``. spindle_rpm : of the cut.
    """
    revolution = 60.0 / spindle_rpm
    time = forces["t_s"].to_numpy(float)
    with style.style():
        figure, grid = style.new_figure(3.9, 3, 2, sharex="col", sharey="row")
        for (left, right), name in zip(grid, "xyz", strict=True):
            force = forces[f"f{name}_n"].to_numpy(float)
            at, low, middle, high = _envelope(time, force, revolution)
            left.fill_between(at, low, high, color=style.SKY, alpha=0.5, lw=0, label="span of a revolution")
            left.plot(at, middle, color=style.AFTER, label="mean over a revolution")
            near = time <= time[0] + REVOLUTIONS * revolution
            right.plot(1e3 * (time[near] - time[0]), force[near], color=style.AFTER)
            left.set_ylabel(f"$F_{name}$ (N)", parse_math=True)
        grid[0][0].set_title("one orbit", loc="left")
        grid[0][1].set_title("its first two revolutions of the tool", loc="left")
        grid[-1][0].set_xlabel("time (s)")
        grid[-1][1].set_xlabel("time (ms)")
        style.legend_above(figure, grid[0][0])
    return figure


def _envelope(time: Array, force: Array, revolution: float) -> tuple[Array, Array, Array, Array]:
    """Middle time, least, mean and greatest of each whole revolution."""
    turn = ((time - time[0]) / revolution + 1e-9).astype(int)
    whole = [turn == k for k in range(int(turn[-1]))]
    bands = np.array([(time[w].mean(), force[w].min(), force[w].mean(), force[w].max()) for w in whole])
    at, low, middle, high = bands.T
    return at, low, middle, high


def means(table: pd.DataFrame, group: list[str]) -> Figure:
    """Draw the mean force of every straight cut over the feed per tooth, and the lines of the coefficients.

    Parameters
    ----------
    table : ``axis, role, feed_per_tooth_mm, measured_n, fitted_n``. group : for each row, the settings of its
        cut without the feed, by which the lines are drawn.
    """
    names = sorted(table["axis"].unique())
    labels = list(dict.fromkeys(group))
    with style.style():
        figure, (row,) = style.new_figure(2.1, 1, len(names))
        for axes, name in zip(row, names, strict=True):
            for k, label in enumerate(labels):
                part = table[(table["axis"] == name) & (np.array(group) == label)]
                part = part.sort_values("feed_per_tooth_mm", kind="stable")
                feed, colour = part["feed_per_tooth_mm"], style.SERIES[k % len(style.SERIES)]
                axes.plot(feed, part["fitted_n"], color=colour, lw=0.9)
                for role, face in (("identify", colour), ("validate", "none")):
                    of_role = (part["role"] == role).to_numpy()
                    dots = feed[of_role], part["measured_n"][of_role]
                    axes.plot(*dots, MARKS[k % len(MARKS)], color=colour, ms=4, mfc=face)
                axes.plot([], [], MARKS[k % len(MARKS)] + "-", color=colour, ms=4, lw=0.9, label=label)
            axes.set_title(name, loc="left")
            axes.set_xlabel("feed per tooth (mm)")
        row[0].set_ylabel("mean force (N)")
        handles, shown = row[0].get_legend_handles_labels()
        abreast = max(1, min(len(shown), LEGEND_ROOM // (max(map(len, shown)) + 6)))
        figure.legend(handles, shown, loc="outside upper center", ncols=abreast, fontsize=8)
    return figure
