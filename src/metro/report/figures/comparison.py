"""Predicted against measured: overlay, residual and parity of one observable of comparison.parquet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from metro.report import style
from metro.units import Array, printed

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COORDINATES = {
    "angle_deg": "spindle angle (°)",
    "s_mm": "path length (mm)",
    "x_mm": "x (mm)",
    "t_s": "time (s)",
}
RUNS, BINS, POINTS = 4, 60, 1200
GAP = 5  # steps without a value at which a line is broken
RUNS_OF_AXES, RUNS_ALONE = 3, 6


@dataclass(frozen=True)
class Prediction:
    """A column of predictions, and its look, which is the same in every figure."""

    column: str
    colour: str
    line: str
    mark: str
    label: str


BEFORE = Prediction("before", style.BEFORE, "--", "x", "base model")
AFTER = Prediction("after", style.AFTER, "-", "o", "with effects found")
ONLY = Prediction("before", style.BEFORE, "--", "x", "base model (nothing added)")


def predictions(frame: pd.DataFrame) -> tuple[Prediction, ...]:
    """Return before and after, or only one of them if nothing was added."""
    return (ONLY,) if np.allclose(frame["before"], frame["after"], rtol=1e-12, atol=0) else (BEFORE, AFTER)


def overlay(frame: pd.DataFrame, title: str, *, alone: bool = False) -> Figure:
    """Draw measured values with their 95 % band and the predictions: a panel per run and axis.

    Of a quantity that repeats (force per revolution) the block in the middle of the record is drawn. Of many
    runs the first few are drawn, see :func:`shown_runs`; there are more if no other observable needs the
    place (``alone``).
    """
    panels = [(run, axis) for run in shown_runs(frame, alone=alone) for axis in axes_of(frame)]
    columns = len(axes_of(frame)) if len(axes_of(frame)) > 1 else min(2, len(panels))
    rows = -(-len(panels) // columns)
    column, drawn = coordinate(frame), predictions(frame)
    with style.style():
        figure, grid = style.new_figure(
            0.65 + 0.8 * rows, rows, columns, sharey=False if len(axes_of(frame)) > 1 else "all"
        )
        flat = [axes for row in grid for axes in row]
        for axes, (run, axis) in zip(flat, panels, strict=False):
            part = _middle_block(frame[(frame["run"] == run) & (axis_labels(frame) == axis)])
            _draw(axes, part.iloc[:: max(1, len(part) // POINTS)], column, drawn)
            axes.set_title(f"{run}{f', {axis}' if axis else ''}", loc="left")
        for axes in flat[len(panels) :]:
            axes.set_visible(False)
        for axes in flat[max(0, len(panels) - columns) : len(panels)]:
            _abscissa(axes, column)
        figure.supylabel(_label(title, frame), fontsize="medium")
        style.legend_above(figure, flat[0])
    return figure


def _draw(axes: Axes, part: pd.DataFrame, column: str, drawn: tuple[Prediction, ...]) -> None:
    part = part.sort_values(column, kind="stable") if column else part
    few, (x, measured, sigma, *predicted) = len(part) <= 60, _broken(part, column, drawn)
    if np.isfinite(sigma).any():
        band = (measured - 1.96 * sigma, measured + 1.96 * sigma)
        axes.fill_between(x, *band, color=style.GREY, alpha=0.35, lw=0, label="measured, 95 % band")
    axes.plot(x, measured, color=style.MEASURED, lw=0.9, marker="." if few else "", label="measured")
    for kind, values in zip(drawn, predicted, strict=True):
        axes.plot(x, values, color=kind.colour, ls=kind.line, label=kind.label)


def _broken(part: pd.DataFrame, column: str, drawn: tuple[Prediction, ...]) -> list[Array]:
    """Return places, measured values, sigma and predictions, with NaN at gaps without measurements."""
    x = _places(part, column)
    step = np.diff(x)
    at = 1 + np.flatnonzero(step > GAP * np.median(step) if len(step) else step)
    names = ["measured", "sigma", *(kind.column for kind in drawn)]
    return [np.insert(values, at, np.nan) for values in (x, *(part[n].to_numpy(float) for n in names))]


def residuals(frame: pd.DataFrame, title: str) -> Figure:
    """Draw the residuals over the coordinate: median and 10–90 % band of all held-out runs."""
    axes_names = axes_of(frame)
    with style.style():
        figure, (row,) = style.new_figure(1.45, 1, len(axes_names), sharey=True)
        for axes, axis in zip(row, axes_names, strict=True):
            _residual(axes, frame[axis_labels(frame) == axis], predictions(frame))
            axes.set_title(axis or title, loc="left")
        row[0].set_ylabel(_label("residual", frame))
        style.legend_above(figure, row[0])
    return figure


def judged(frame: pd.DataFrame, title: str) -> Figure:
    """Draw :func:`residuals` and :func:`parity` side by side, for an observable with one axis."""
    drawn = predictions(frame)
    with style.style():
        figure, ((left, middle, right),) = style.new_figure(1.5, 1, 3)
        _residual(left, frame, drawn)
        left.set_title("Residual of all runs", loc="left")
        left.set_ylabel(_label("residual", frame))
        _equal(middle, frame, drawn)
        middle.set_title("Parity", loc="left")
        middle.set(xlabel=_label(f"{title}, measured", frame), ylabel=_label("predicted", frame))
        _histogram(right, frame)
        right.set_title("Residual, distribution", loc="left")
        right.set(xlabel=_label("measured − predicted", frame), ylabel="share per bin")
        _legend(figure, middle, right)
    return figure


def _residual(axes: Axes, part: pd.DataFrame, drawn: tuple[Prediction, ...]) -> None:
    """Median and 10–90 % band of the residuals over the coordinate."""
    column = coordinate(part)
    x = _places(part, column)
    for kind in drawn:
        at, low, middle, high = _bands(x, (part["measured"] - part[kind.column]).to_numpy(float))
        axes.fill_between(at, low, high, color=kind.colour, alpha=0.22, lw=0)
        axes.plot(at, middle, color=kind.colour, ls=kind.line, label=kind.label)
    axes.axhline(0, color=style.MEASURED, lw=0.6)
    _abscissa(axes, column)


def parity(frame: pd.DataFrame, title: str) -> Figure:
    """Draw predicted over measured, axis by axis, and the distribution of the residuals."""
    names, drawn = axes_of(frame), predictions(frame)
    with style.style():
        figure, (row,) = style.new_figure(1.5, 1, len(names) + 1)
        for axes, name in zip(row, names, strict=False):
            _equal(axes, frame[axis_labels(frame) == name], drawn)
            axes.set_title(f"Parity, {name}" if len(names) > 1 else "Parity", loc="left")
            axes.set_xlabel(_label("measured" if len(names) > 1 else f"{title}, measured", frame))
        row[0].set_ylabel(_label("predicted", frame))
        _histogram(row[-1], frame)
        row[-1].set_title("Residual", loc="left")
        difference = "difference" if len(names) > 1 else "measured − predicted"
        row[-1].set(xlabel=_label(difference, frame), ylabel="share per bin")
        _legend(figure, row[0], row[-1])
    return figure


def _equal(axes: Axes, part: pd.DataFrame, drawn: tuple[Prediction, ...]) -> None:
    """Scatter of the predictions over the measured values, and the line on which both are equal."""
    thin = part.sample(min(len(part), POINTS), random_state=0)
    for kind in drawn:
        axes.scatter(
            *(thin["measured"], thin[kind.column]),
            s=7,
            c=kind.colour,
            marker=kind.mark,
            lw=0.5,
            alpha=0.6,
            label=kind.label,
            clip_on=False,
        )
    span = part[["measured", "before", "after"]].to_numpy(float)
    ends = [float(span.min()), float(span.max())]
    axes.plot(ends, ends, color=style.MEASURED, lw=0.7, label="equal")


def _legend(figure: Figure, points: Axes, bars: Axes) -> None:
    """One legend for points and histogram: the series of both have the same colours and names."""
    named: dict[str, Artist] = {}
    for axes in (points, bars):
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(label, handle)
    figure.legend(list(named.values()), list(named), loc="outside upper center", ncols=len(named))


def _histogram(axes: Axes, frame: pd.DataFrame) -> None:
    """Histograms of the residuals, and the distribution of the noise alone."""
    drawn = predictions(frame)
    differences = [(frame["measured"] - frame[kind.column]).to_numpy(float) for kind in drawn]
    edge = max(float(np.quantile(np.abs(r), 0.995)) for r in differences) or 1.0
    bins = np.linspace(-edge, edge, 1 + min(40, max(8, 2 * round(len(frame) ** 0.5))))
    shares = [np.histogram(r, bins)[0] / len(frame) for r in differences]
    for kind, share in zip(drawn, shares, strict=True):
        axes.stairs(share, bins, color=kind.colour, ls=kind.line, lw=1.1, label=kind.label)
    top = max(float(share.max()) for share in shares)
    sigma = frame["sigma"].dropna().to_numpy(float)
    if sigma.size and sigma.any():
        at, sd = np.linspace(-edge, edge, 401), float(np.sqrt(np.mean(sigma**2)))
        normal = np.exp(-0.5 * (at / sd) ** 2) / (sd * np.sqrt(2 * np.pi)) * (bins[1] - bins[0])
        axes.plot(at, np.minimum(normal, 1.2 * top), color=style.GREY, lw=0.9, label="noise alone")
    axes.set_ylim(0, 1.25 * top)


def _places(part: pd.DataFrame, column: str) -> Array:
    places: Array = part[column].to_numpy(float) if column else np.arange(1.0, len(part) + 1)
    return places


def _abscissa(axes: Axes, column: str) -> None:
    from matplotlib.ticker import MaxNLocator

    axes.set_xlabel(COORDINATES.get(column, "place in the table"))
    if not column:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))


def shown_runs(frame: pd.DataFrame, *, alone: bool = False) -> list[str]:
    """Return the runs that the overlay shows: the first few in the order of the table."""
    most = RUNS if len(axes_of(frame)) == 1 else RUNS_OF_AXES
    most = RUNS_ALONE if alone else most
    return [str(run) for run in frame["run"].drop_duplicates()][:most]


def axes_of(frame: pd.DataFrame) -> list[str]:
    """Return the axes that occur, in alphabetical order; one empty name if the observable has no axes."""
    return sorted(axis_labels(frame).unique())


def axis_labels(frame: pd.DataFrame) -> pd.Series:
    """Return the axis of each row as text, empty if it has none."""
    return frame["axis"].fillna("").astype(str)


def coordinate(frame: pd.DataFrame) -> str:
    """Return the column over which the rows are drawn: the first that is given and varies; else empty."""
    for column in COORDINATES:
        if frame[column].notna().all() and frame[column].nunique() > 1:
            return column
    return ""


def _middle_block(part: pd.DataFrame) -> pd.DataFrame:
    times = np.unique(part["t_s"].dropna())
    if part["angle_deg"].isna().any() or times.size == 0:
        return part
    middle: pd.DataFrame = part[part["t_s"] == times[times.size // 2]]
    return middle


def _bands(x: Array, y: Array) -> tuple[Array, Array, Array, Array]:
    """Place and quantiles 0.1, 0.5, 0.9 of y in the bins of x that are not empty."""
    place = np.minimum((BINS * (x - x.min()) / (np.ptp(x) or 1.0)).astype(int), BINS - 1)
    filled = np.unique(place)
    at = np.array([x[place == p].mean() for p in filled])
    low, middle, high = np.array([np.quantile(y[place == p], (0.1, 0.5, 0.9)) for p in filled]).T
    return at, low, middle, high


def _label(text: str, frame: pd.DataFrame) -> str:
    unit = printed(str(frame["unit"].iloc[0]))
    return f"{text} ({unit})" if unit else text
