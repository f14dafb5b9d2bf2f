"""The look of every figure, and how a figure becomes bytes that are the same for the same data."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Share = bool | Literal["none", "all", "row", "col"]

# Okabe & Ito (2008): told apart with every common kind of colour vision, and in grey by line style and marker
MEASURED, BEFORE, AFTER = "#000000", "#D55E00", "#0072B2"
GREY, GREEN, PURPLE, SKY, YELLOW = "#8C8C8C", "#009E73", "#CC79A7", "#56B4E9", "#E69F00"
SERIES = (AFTER, BEFORE, GREEN, PURPLE, YELLOW, SKY, MEASURED)
DIVERGING, SEQUENTIAL = "RdBu_r", "cividis"
WIDTH, HALF = 6.7, 3.25  # of the text, and of one of two figures abreast, inches

RC = {
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.labelsize": 9,
    "legend.fontsize": 8.5,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#E3E3E3",
    "grid.linewidth": 0.5,
    "axes.axisbelow": True,
    "lines.linewidth": 1.1,
    "legend.frameon": False,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "axes.unicode_minus": True,
    # names of runs are not formulas, whatever dollars they hold; a label that is one says so (parse_math)
    "text.parse_math": False,
    "svg.hashsalt": "metro",
    "svg.fonttype": "path",
}


@contextmanager
def style() -> Iterator[None]:
    """Draw with the report's style inside this block, and leave matplotlib as it was."""
    import matplotlib as mpl

    with mpl.rc_context(RC):
        yield


def new_figure(
    height: float,
    rows: int = 1,
    columns: int = 1,
    *,
    sharex: Share = False,
    sharey: Share = False,
    width: float = WIDTH,
) -> tuple[Figure, list[list[Axes]]]:
    """Return a figure as wide as the text, or ``width`` inches, ``height`` high; its axes as rows."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharex=sharex, sharey=sharey)
    return figure, [list(row) for row in axes]


def legend_above(figure: Figure, axes: Axes) -> None:
    """Put the one legend of a figure in a row above all panels."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=max(1, len(labels)))


def to_svg(figure: Figure) -> bytes:
    """Return a figure as SVG, byte for byte the same for the same figure."""
    import matplotlib as mpl

    with mpl.rc_context({"svg.hashsalt": RC["svg.hashsalt"], "svg.fonttype": RC["svg.fonttype"]}):
        stream = io.BytesIO()
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    return stream.getvalue()
