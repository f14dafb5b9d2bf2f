"""What the records of the test cuts say, drawn on the lobes, and the roughness of what they left."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from metro.report import style
from metro.report.figures.lobes import drawn_with_tests, entries, panels_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# kind of chatter: mark, colour, words
KINDS = {
    "forced": ("o", style.GREEN, "stable"),
    "hopf": ("X", style.BEFORE, "chatter (Hopf)"),
    "flip": ("P", style.PURPLE, "chatter (flip)"),
    "low_frequency": ("D", style.YELLOW, "chatter in a mode of the robot"),
    "unknown": ("$?$", style.MEASURED, "unknown kind, or cannot be told"),
}
STABLE = ((0, style.GREEN, "stable"), (1, style.BEFORE, "chatter"))
ROUGHNESS = (("ra_um", "Ra (µm)"), ("rz_um", "Rz (µm)"))


def tests_chart(boundary: pd.DataFrame, tests: pd.DataFrame) -> Figure:
    """Draw every test on the lobes of its position, with what its record says; wrong labels are circled.

    Parameters
    ----------
    boundary : as for :func:`metro.report.figures.lobes.lobes_chart`.
    tests : ``position, rpm, depth_mm, kind, wrong_label``.
    """
    with style.style():
        figure, panels = panels_of(boundary)
        for position, axes in panels.items():
            _, here = drawn_with_tests(axes, position, boundary, tests)
            _marks(axes, here)
        handles, labels = max(panels.values(), key=entries).get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4)
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


def roughness_chart(tests: pd.DataFrame) -> Figure:
    """Draw Ra and Rz over the depth of cut, stable tests beside unstable ones, with their medians.

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
