"""The parts of a report: sections of paragraphs, tables and figures. The template decides on their look."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Paragraph:
    """Running text. ``look``: ``plain``, ``verdict`` (set off, large), ``note`` (small), or ``warning``."""

    text: str
    look: str = "plain"


@dataclass(frozen=True)
class Bullets:
    """A list of sentences; ``small``: in the type of a note."""

    items: Sequence[str]
    small: bool = False


@dataclass(frozen=True)
class Table:
    """A table of strings.

    Attributes
    ----------
    header : one title per column.
    rows : strings, as many per row as the header has.
    caption : one sentence.
    widths : relative widths of the columns; 0 for "as wide as the text".
    numeric : columns that are set flush right.
    strong : rows that are emphasised.
    faint : columns that are set in grey.
    small : set in small type (hashes, long lists).
    tall : with room to write in by hand.
    """

    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str
    widths: Sequence[float] = ()
    numeric: Sequence[int] = ()
    strong: Sequence[int] = ()
    faint: Sequence[int] = ()
    small: bool = False
    tall: bool = False


@dataclass(frozen=True)
class Picture:
    """A figure with its caption, and with a description for readers who cannot see it."""

    figure: Figure
    caption: str
    alt: str

    @cached_property
    def svg(self) -> bytes:
        """The figure, drawn once for the PDF and the page."""
        from metro.report import style

        return style.to_svg(self.figure)


@dataclass(frozen=True)
class Facts:
    """Key numbers, side by side: (label, value, remark)."""

    items: Sequence[tuple[str, str, str]]


@dataclass(frozen=True)
class Heading:
    """A heading inside a section."""

    text: str


@dataclass(frozen=True)
class Abreast:
    """One or two items, each half as wide as the page: narrow tables, figures drawn for half the width."""

    items: Sequence[Table | Picture]


Simple = Paragraph | Bullets | Table | Picture | Facts | Heading
Item = Simple | Abreast


def gathered(rows: Sequence[Sequence[str]]) -> list[list[str]]:
    """Join the rows of a table that differ only in their first cell: r01, r02 and r05 share a row."""
    shared: dict[tuple[str, ...], list[str]] = {}
    for first, *cells in rows:
        shared.setdefault(tuple(cells), []).append(first)
    return [[", ".join(names), *cells] for cells, names in shared.items()]


def common(header: Sequence[str], rows: Sequence[Sequence[str]]) -> tuple[list[str], list[list[str]], str]:
    """Take the columns with one value in all rows out of a table, and say these values in a sentence."""
    columns = list(zip(*rows, strict=True))
    same = [i for i, column in enumerate(columns) if i and len(rows) > 1 and len(set(column)) == 1]
    kept = [i for i in range(len(header)) if i not in same]
    said = "; ".join(f"{header[i]} {rows[0][i]}" for i in same)
    return (
        [header[i] for i in kept],
        [[row[i] for i in kept] for row in rows],
        f" All rows: {said}." if said else "",
    )


def abreast(items: Sequence[Table | Picture]) -> list[Item]:
    """Arrange items in pairs, side by side."""
    return [Abreast(items[i : i + 2]) for i in range(0, len(items), 2)]


@dataclass(frozen=True)
class Section:
    """A titled part of the report; ``page`` starts it on a new page."""

    title: str
    items: Sequence[Item]
    page: bool = False
