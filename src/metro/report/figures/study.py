"""Figures of a factorial study: interactions of factors, ranking of configurations, and its prediction."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from metro.report import style
from metro.units import JSON, Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_PAIRS = 3
MOST_RANKED = 24
MARKERS = ("o", "s", "^", "D", "v", "P")


def interactions(ranking: Sequence[JSON]) -> Figure:
    """Draw X_m over the levels of one factor, a line for each level of another, for pairs of factors.

    Each dot is a configuration; lines join their geometric means. Lines that are not parallel (on the
    logarithmic axis) are an interaction.

    Parameters
    ----------
    ranking : of ``identified.json``: ``levels`` (factor → level) and ``xm``, two factors or more.
    """
    names = list(ranking[0]["levels"])
    pairs = list(itertools.combinations(names, 2))[:MOST_PAIRS]
    with style.style():
        figure, grid = style.new_figure(3.0, 1, len(pairs), sharey=True)
        for axes, (across, beside) in zip(grid[0], pairs, strict=True):
            _pair(axes, ranking, across, beside)
        grid[0][0].set_ylabel("$X_m$ (µm)", parse_math=True)
        grid[0][0].set_yscale("log")
        ticks(grid[0][0], [float(row["xm"]["value"]) for row in ranking])
    return figure


def _pair(axes: Axes, ranking: Sequence[JSON], across: str, beside: str) -> None:
    places = {level: i for i, level in enumerate(sorted({row["levels"][across] for row in ranking}))}
    lines = sorted({row["levels"][beside] for row in ranking})
    for number, level in enumerate(lines):
        rows = [row for row in ranking if row["levels"][beside] == level]
        x = np.array([places[row["levels"][across]] for row in rows])
        y = np.array([float(row["xm"]["value"]) for row in rows])
        colour, marker = style.SERIES[number % len(style.SERIES)], MARKERS[number % len(MARKERS)]
        at = np.unique(x)
        means = [np.exp(np.log(y[x == place]).mean()) for place in at]
        axes.plot(x, y, marker, color=colour, markersize=3.5, alpha=0.45, markeredgewidth=0)
        axes.plot(at, means, marker + "-", color=colour, markersize=5, label=_level(beside, level))
    axes.set_xticks(list(places.values()), list(places))
    axes.set_xlim(-0.35, len(places) - 0.65)
    axes.set_xlabel(across)
    axes.legend(fontsize=8, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2)


def _level(factor: str, level: str) -> str:
    """Write a level behind its factor, the unit behind both: axial depth 1.5 mm."""
    name, _, unit = factor.partition(" (")
    return f"{name} {level} {unit.removesuffix(')')}".rstrip()


def ticks(axes: Axes, values: Sequence[float]) -> None:
    """Put plain numbers on a logarithmic axis of less than a decade, which has no ticks by default."""
    from matplotlib.ticker import FixedLocator, NullFormatter, NullLocator, StrMethodFormatter

    low, high = min(values), max(values)
    if high < 20 * low:
        steps = np.array([1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0])
        marks = np.concatenate([steps * 10.0**power for power in range(-1, 5)])
        axes.yaxis.set_major_locator(FixedLocator([m for m in marks if 0.8 * low <= m <= 1.25 * high]))
        axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.yaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_minor_formatter(NullFormatter())


def ranking(rows: Sequence[JSON], after: Sequence[JSON] = (), model: str = "base model") -> Figure:
    """Draw the configurations from best to worst with 95 % intervals, and their predicted ranks.

    Parameters
    ----------
    rows : of ``identified.json``: ``configuration``, ``xm``, ``xm_predicted`` (um, or None),
        ``probability_best``. after : such rows, predicted with the identified effects. model : name of the
        model that predicted the others.
    """
    shown = list(rows)[:MOST_RANKED]
    known = [row for row in rows if row.get("xm_predicted") is not None]
    kinds = [(model, style.BEFORE, "s", known)]
    later = {row["configuration"]: row["xm_predicted"] for row in after}
    if later:
        kinds.append(("with effects", style.AFTER, "^", [r for r in rows if later.get(r["configuration"])]))
    with style.style():
        figure, grid = style.new_figure(1.0 + 0.27 * max(len(shown), 6), 1, 2 if len(known) > 2 else 1)
        _list(grid[0][0], shown, "xm", "measured")
        height = np.arange(len(shown))
        if known:
            x = [row["xm_predicted"] if row.get("xm_predicted") is not None else np.nan for row in shown]
            grid[0][0].plot(x, height, "s", color=style.BEFORE, markersize=4, label=f"predicted, {model}")
        if later:
            x = [later.get(row["configuration"]) or np.nan for row in shown]
            grid[0][0].plot(x, height, "^", color=style.AFTER, markersize=4, label="with effects")
        grid[0][0].legend(loc="upper left", bbox_to_anchor=(0.0, -0.2), ncols=2)
        if len(known) > 2:
            for name, colour, marker, part in kinds:
                own = (
                    later if name == "with effects" else {r["configuration"]: r["xm_predicted"] for r in part}
                )
                first = _ranks(np.array([float(row["xm"]["value"]) for row in part]))
                second = _ranks(np.array([float(own[row["configuration"]]) for row in part]))
                grid[0][1].plot(
                    first, second, marker, color=colour, markersize=6, label=name, fillstyle="none"
                )
            _parity(grid[0][1], len(known))
    return figure


def _ranks(values: Array) -> Array:
    from scipy.stats import rankdata

    return np.asarray(rankdata(values), dtype=np.float64)


def _parity(axes: Axes, count: int) -> None:
    axes.plot([0.5, count + 0.5], [0.5, count + 0.5], color=style.GREY, linewidth=0.8)
    axes.set(xlabel="measured rank (1: flattest)", ylabel="predicted rank", aspect="equal")
    axes.set(xlim=(0.5, count + 0.5), ylim=(0.5, count + 0.5))
    marks = np.arange(1, count + 1, max(1, count // 8))
    axes.set_xticks(marks)
    axes.set_yticks(marks)
    axes.legend(loc="upper left")


def _list(axes: Axes, rows: Sequence[JSON], key: str, label: str) -> None:
    """Values with their intervals from the top down, each with its probability of being best."""
    height = np.arange(len(rows))
    value = np.array([float(row[key]["value"]) for row in rows])
    bounds = np.array([[np.nan if b is None else b for b in row[key]["ci95"]] for row in rows], dtype=float)
    error = np.abs(bounds.T - value)
    if np.isfinite(error).any():
        axes.errorbar(value, height, xerr=error, fmt="o", color=style.MEASURED, markersize=4, label=label)
    else:
        axes.plot(value, height, "o", color=style.MEASURED, markersize=4, label=label)
    axes.set_yticks(height, [row["configuration"] for row in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlim(left=0)
    axes.set_xlabel("$X_m$ (µm)", parse_math=True)
    for y, row in zip(height, rows, strict=True):
        if row.get("probability_best") is not None:
            axes.annotate(
                f"{100 * row['probability_best']:.0f} %",
                (1.0, y),
                xycoords=("axes fraction", "data"),
                xytext=(3, 0),
                textcoords="offset points",
                va="center",
                fontsize=8,
                color=style.GREY,
            )


def advice(rows: Sequence[JSON]) -> Figure:
    """Draw the planned configurations, from best to worst by prediction, with 95 % intervals.

    Parameters
    ----------
    rows : ``configuration``, ``xm_predicted`` with ``ci95``, ``probability_best``.
    """
    shown = list(rows)[:MOST_RANKED]
    with style.style():
        figure, grid = style.new_figure(0.7 + 0.27 * max(len(shown), 3))
        _list(grid[0][0], shown, "xm_predicted", "predicted")
        grid[0][0].set_xlabel("$X_m$ predicted (µm); beside: probability of being the least", parse_math=True)
    return figure
