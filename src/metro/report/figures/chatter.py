"""Chatter detected in the records of the test cuts, drawn on the lobes, and the roughness of the surfaces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import pandas as pd

from metro.report import style
from metro.report.figures.lobes import draw_advised, drawn_with_tests, panels_of
from metro.units import JSON

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# kind of chatter: mark, colour, words
KINDS = {
    "forced": ("o", style.GREEN, "stable"),
    "hopf": ("X", style.BEFORE, "chatter (Hopf)"),
    "flip": ("P", style.PURPLE, "chatter (flip)"),
    "low_frequency": ("D", style.YELLOW, "chatter in a mode of the robot"),
    "unknown": ("*", style.MEASURED, "kind unknown or not determined"),
}
STABLE = ((0, style.GREEN, "stable"), (1, style.BEFORE, "chatter"))
NUMBERED = 25  # most tests of which each has its probability next to it
SPECTRUM_TO = 6.5  # tooth passings, of a spectrum that is drawn; at least this much of the chatter frequency:
BEYOND_CHATTER = 1.3
ROUGHNESS = (("ra_um", "Ra (µm)"), ("rz_um", "Rz (µm)"))


def tests_chart(
    boundary: pd.DataFrame,
    tests: pd.DataFrame,
    *,
    advised: Mapping[str, JSON],
    deepest_mm: float,
) -> Figure:
    """Draw every test on the lobes of its position, by the detection in its record; circle wrong labels.

    Parameters
    ----------
    boundary, advised, deepest_mm : see :func:`metro.report.figures.lobes.lobes_chart`.
    tests : ``position, rpm, depth_mm, kind, probability, wrong_label``.
    """
    with style.style():
        figure, panels = panels_of(boundary)
        for position, axes in panels.items():
            _, here = drawn_with_tests(axes, position, boundary, tests, deepest_mm)
            _marks(axes, here)
            draw_advised(axes, advised.get(str(position)))
            if len(tests) <= NUMBERED:
                _probabilities(axes, here)
        style.legend_of(figure, panels.values())
    return figure


def _marks(axes: Axes, tests: pd.DataFrame) -> None:
    for kind, (mark, colour, label) in KINDS.items():
        part = tests[tests["kind"] == kind]
        if len(part):
            place = (part["rpm"], part["depth_mm"])
            axes.scatter(*place, marker=mark, s=28, c=colour, lw=0.5, zorder=3, label=label)
    wrong = tests[tests["wrong_label"]]
    if len(wrong):
        axes.scatter(
            wrong["rpm"],
            wrong["depth_mm"],
            s=90,
            facecolors="none",
            edgecolors=style.MEASURED,
            lw=0.8,
            zorder=2,
            label="labelled otherwise",
        )


def _probabilities(axes: Axes, tests: pd.DataFrame) -> None:
    for _, test in tests.iterrows():
        place = (test["rpm"], test["depth_mm"])
        axes.annotate(
            f"{test['probability']:.2f}", place, (7, 0), textcoords="offset points", va="center", fontsize=8
        )


def records_chart(records: pd.DataFrame, tests: pd.DataFrame, teeth: int) -> Figure:
    """Draw spectrum and force of a cut that chattered and of a stable one, a row each; chatter is marked.

    Parameters
    ----------
    records : ``run, part, x, value, on_order``, as observed.
    tests : a row per run of the records: ``rpm, depth_mm, chatter_hz, unstable``.
    teeth : number of teeth of the tool.
    """
    runs = list(records["run"].drop_duplicates())
    with style.style():
        figure, grid = style.new_figure(0.5 + 2.0 * len(runs), len(runs), 2)
        for run, (left, right) in zip(runs, grid, strict=True):
            test = tests[tests["run"] == run].iloc[0]
            here = records[records["run"] == run]
            _spectrum(left, here[here["part"] == "spectrum"], test, teeth)
            trace = here[here["part"] == "force"]
            _, colour, words = STABLE[int(test["unstable"])]
            right.plot(trace["x"], trace["value"], color=colour, lw=0.8)
            right.set(xlabel="time (s)", ylabel="force less its mean (N)")
            left.set_title(f"{run}: {words}, {test['rpm']:.0f} rpm, {test['depth_mm']:g} mm", loc="left")
        handles, labels = grid[0][0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return figure


def _spectrum(axes: Axes, lines: pd.DataFrame, test: pd.Series, teeth: int) -> None:
    """Draw a spectrum, on and off the orders of the spindle, with tooth passings and chatter marked."""
    passing = teeth * float(test["rpm"]) / 60.0
    chatter = float(test["chatter_hz"])
    last = max(SPECTRUM_TO * passing, BEYOND_CHATTER * chatter if chatter > 0.0 else 0.0)
    shown = lines[lines["x"] <= last]
    for on_order, colour, label in (
        (True, style.GREY, "orders of the spindle"),
        (False, style.AFTER, "remaining force"),
    ):
        height = shown["value"].where(shown["on_order"].astype(bool) == on_order, 0.0)
        axes.vlines(shown["x"], 0.0, height, color=colour, lw=0.9, label=label)
    top = 1.22 * float(shown["value"].max())
    multiples = [k * passing for k in range(1, int(last / passing) + 1)]
    axes.plot(
        multiples, [0.97 * top] * len(multiples), "v", color=style.MEASURED, ms=3, label="tooth passing"
    )
    if chatter > 0.0:
        at = float(shown["value"].to_numpy(float)[(shown["x"] - chatter).abs().to_numpy(float).argmin()])
        axes.annotate(
            f"chatter {chatter:.1f} Hz",
            (chatter, at),
            (chatter + 0.06 * last, 0.8 * top),
            color=style.BEFORE,
            fontsize=8,
            arrowprops={"arrowstyle": "->", "color": style.BEFORE},
        )
    axes.set(xlim=(0.0, last), ylim=(0.0, top), xlabel="frequency (Hz)", ylabel="force amplitude (N)")


def roughness_chart(tests: pd.DataFrame) -> Figure:
    """Draw Ra and Rz over the depth of cut, for stable and for unstable tests, with their medians.

    Parameters
    ----------
    tests : ``depth_mm, ra_um, rz_um, unstable`` (1 or 0).
    """
    with style.style():
        figure, [row] = style.new_figure(2.6, 1, len(ROUGHNESS))
        for axes, (column, label) in zip(row, ROUGHNESS, strict=True):
            for unstable, colour, words in STABLE:
                part = tests[tests["unstable"] == unstable]
                if len(part):
                    axes.scatter(part["depth_mm"], part[column], s=22, c=colour, label=words)
                    axes.axhline(part[column].median(), color=colour, ls="--", lw=0.9)
            axes.set(xlabel="depth of cut (mm)", ylabel=label)
            axes.set_ylim(bottom=0.0)
        style.legend_above(figure, row[0])
    return figure
