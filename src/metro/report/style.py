"""The look of every figure, and its rendering to bytes that are the same for the same data."""

from __future__ import annotations

import functools
import io
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Share = bool | Literal["none", "all", "row", "col"]

# Okabe & Ito (2008): distinct for every common kind of colour vision, and in grey by line style and marker
MEASURED, BEFORE, AFTER = "#000000", "#D55E00", "#0072B2"
GREY, GREEN, PURPLE, SKY, YELLOW = "#8C8C8C", "#009E73", "#CC79A7", "#56B4E9", "#E69F00"
AXES = (("x", AFTER), ("y", BEFORE), ("z", GREEN))
SERIES = (AFTER, BEFORE, GREEN, PURPLE, YELLOW, SKY, MEASURED)
DIVERGING, SEQUENTIAL = "RdBu_r", "cividis"
WIDTH, HALF = 6.7, 3.25  # of the text, and of one of two figures abreast, inches

FAMILY = "STIXGeneral"
RC = {
    "font.family": FAMILY,
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
    # Names of runs with dollar signs are not formulas; a label that is a formula sets parse_math itself.
    "text.parse_math": False,
    "svg.hashsalt": "metro",
    "svg.fonttype": "path",
}


@contextmanager
def style() -> Iterator[None]:
    """Draw with the report's style inside this block, and restore the style of matplotlib after it."""
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


def legend_of(figure: Figure, panels: Iterable[Axes]) -> None:
    """Put one legend above all panels, with what any of them draws, and with nothing else."""
    named = {
        label: handle
        for axes in panels
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(
        list(named.values()), list(named), loc="outside upper center", ncols=min(4, max(1, len(named)))
    )


def to_svg(figure: Figure) -> bytes:
    """Return a figure as SVG, byte for byte the same for the same figure."""
    import matplotlib as mpl

    _make_drawable(figure)
    with mpl.rc_context({"svg.hashsalt": RC["svg.hashsalt"], "svg.fonttype": RC["svg.fonttype"]}):
        stream = io.BytesIO()
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    return stream.getvalue()


def _make_drawable(figure: Figure) -> None:
    """Give each text of a figure fonts that have its characters; name in brackets those that none has."""
    from matplotlib.text import Text
    from matplotlib.ticker import ScalarFormatter

    for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)):
        if isinstance(axis.get_major_formatter(), ScalarFormatter):
            continue
        labels = [label.get_text() for label in axis.get_ticklabels()]
        drawable = [_drawable(label)[0] for label in labels]
        if drawable != labels:  # a tick writes what its formatter says, whatever text it was given
            axis.set_ticks(axis.get_ticklocs(), labels=drawable)
    for text in figure.findobj(Text):
        content, fonts = _drawable(text.get_text())
        if content != text.get_text():
            text.set_text(content)
        if fonts:
            text.set_fontfamily([FAMILY, *(_family(font) for font in fonts)])


@functools.cache
def _drawable(text: str) -> tuple[str, tuple[Path, ...]]:
    """Return a text as it can be drawn, and the fonts that it needs beside that of the style."""
    from metro.report import glyphs

    own, second = _own_fonts()
    text = glyphs.shortened(text)
    lacked = {
        character for character in text if character != "\n" and ord(character) not in glyphs.coverage(own)
    }
    if not lacked:
        return text, ()
    others = glyphs.fonts_with(c for c in lacked if ord(c) not in glyphs.coverage(second))
    found = frozenset[int]().union(*(glyphs.coverage(font) for font in (second, *others)))
    return glyphs.without(text, {c for c in lacked if ord(c) not in found}), (second, *others)


@functools.cache
def _own_fonts() -> tuple[Path, ...]:
    """Return the files of the fonts that come with matplotlib: that of the style, and one of many signs."""
    from matplotlib import font_manager

    return tuple(Path(font_manager.findfont(name)) for name in (FAMILY, "DejaVu Sans"))


@functools.cache
def _family(font: Path) -> str:
    """Return the name by which matplotlib finds a font file."""
    from matplotlib import font_manager

    known = {Path(entry.fname): entry.name for entry in font_manager.fontManager.ttflist}
    if font not in known:
        font_manager.fontManager.addfont(font)
    return known.get(font) or font_manager.get_font(str(font)).family_name
