"""Point clouds as plain text: XYZ, TXT, ASC, CSV."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from metro.formats.cloud import own_names, piece
from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw
from metro.formats.text import SPACES, Layout, fields, is_number, lines, number_pieces

_HEADER_LINES = 100


def xyz_pieces(path: Path, kind: Kind, rows: int | None) -> Iterator[Raw]:
    """Read a cloud of one point a line, parted by spaces, tabs, commas or semicolons.

    Comments (``//`` or ``#``), a line with the number of points and a header may come before the points.
    Without a header that names x, y and z these are the first three columns.
    """
    layout = _layout(path, kind)
    own = own_names(path, kind, layout.names)
    for found in number_pieces(path, layout, list(own.values()), rows):
        yield piece(own, found.frame, found.place)


def _layout(path: Path, kind: Kind) -> Layout:
    header = ""
    for number, text in lines(path):
        parted_by = _separator(text)
        found = fields(text, parted_by)
        if len(found) >= 3 and all(is_number(field) for field in found[:3]):
            return Layout(_names(header, len(found)), parted_by, number - 1)
        if number > _HEADER_LINES:
            break
        header = text
    found_none = f"found no line of three numbers x y z in the first {_HEADER_LINES} lines"
    raise FormatError(path, f"{found_none}, expected {kind.title} with decimal points")


def _separator(text: str) -> str:
    return next((mark for mark in (";", ",") if mark in text), SPACES)


def _names(header: str, count: int) -> tuple[str, ...]:
    """Take the columns' names from the last line before the points, if it has as many fields as they have."""
    text = header.lstrip("/ ")
    names = tuple(field.lower() for field in fields(text, _separator(text)))
    if len(names) == count and {name[:1] for name in names} >= {"x", "y", "z"}:
        return names
    return ("x", "y", "z", *(f"field {index}" for index in range(3, count)))
