"""Point clouds as plain text: XYZ, TXT, ASC, CSV."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np

from metro.formats.channels import parted
from metro.formats.cloud import own_names, piece
from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw
from metro.formats.measures import MeasureError, measure
from metro.formats.text import SPACES, Layout, fields, is_number, lines, number_pieces
from metro.units import Array

_HEADER_LINES = 100
_FIRST = ("x", "y", "z")
_LOOKED_AT = 32  # rows without names
_FEWEST = 3  # rows that show what their columns are
_ROUNDED = 0.01  # three components printed to two decimals: 3^½ · 0.005 at most
_WHITE = 255


def xyz_pieces(path: Path, kind: Kind, rows: int | None) -> Iterator[Raw]:
    """Read a cloud of one point a line, parted by spaces, tabs, commas or semicolons.

    Comments (``//`` or ``#``), a line with the number of points and a header may come before the points.
    Without a header that names x, y and z these are the first three columns.
    """
    layout = _layout(path, kind)
    if layout.names[:3] == _FIRST:
        _check_unnamed(path, layout)
    own = own_names(path, kind, layout.names)
    for raw in number_pieces(path, layout, list(own.values()), rows):
        yield piece(own, raw.frame, raw.place)


def _layout(path: Path, kind: Kind) -> Layout:
    header = ""
    for number, text in lines(path):
        parted_by = _separator(text)
        parts = fields(text, parted_by)
        if len(parts) >= 3 and all(is_number(field) for field in parts[:3]):
            return Layout(_names(path, header, len(parts)), parted_by, number - 1)
        if number > _HEADER_LINES:
            break
        header = text
    fault = f"found no line of three numbers x y z in the first {_HEADER_LINES} lines"
    raise FormatError(path, f"{fault}, expected {kind.title} with decimal points")


def _separator(text: str) -> str:
    return next((mark for mark in (";", ",") if mark in text), SPACES)


def _names(path: Path, header: str, count: int) -> tuple[str, ...]:
    """Take the columns' names from the last line before the points, if it has as many fields as they have.

    Raises
    ------
    FormatError
        Where it names something else: the unit behind a name is that of no length.
    """
    text = header.lstrip("/ ")
    own = fields(text, _separator(text))
    names = tuple(field.lower() for field in own)
    if len(names) == count and {name[:1] for name in names} >= {"x", "y", "z"}:
        return names
    if len(names) == count and any(_quantity(field) not in ("", "length") for field in own):
        found = f"its columns are named {', '.join(own)}, expected coordinates x, y, z in mm"
        raise FormatError(path, f"{found}; {_what_to_write(path, 1)}")
    return (*_FIRST, *(f"field {index}" for index in range(3, count)))


def _quantity(name: str) -> str:
    """Return the quantity that the unit behind a column's name measures; "" where none does."""
    try:
        return measure(parted(name)[1]).quantity
    except MeasureError:
        return ""


def _what_to_write(path: Path, first: int) -> str:
    """Say how ``batch.yaml`` states that the coordinates are three columns from the ``first`` on."""
    mapping = ", ".join(f"{axis}_mm: {{from: {first + k}, unit: mm}}" for k, axis in enumerate("xyz"))
    files = f'files: {{"{path.name}": {{columns: {{{mapping}}}}}}}'
    return f"write in batch.yaml which columns are the coordinates, as {files}"


def _check_unnamed(path: Path, layout: Layout) -> None:
    """Refuse columns without names whose first three need not be coordinates.

    Those are: a first column that counts the points, a first three that are directions, and six columns of
    which the last three are neither directions nor colours.

    Raises
    ------
    FormatError
        With what to write in ``batch.yaml``.
    """
    rows = [fields(text, layout.parted_by) for _, text in islice(lines(path, layout.skip), _LOOKED_AT)]
    rows = [row for row in rows if len(row) == len(layout.names) and all(map(is_number, row))]
    values = np.array(rows, dtype=float).reshape(-1, len(layout.names))
    count = len(layout.names)
    if len(values) < _FEWEST or count == len(_FIRST):
        return
    last = values[:, 3:6]
    if (np.diff(values[:, 0]) == 1.0).all():
        why, first = "its first column counts the rows: is it a number of the point or a coordinate?", 2
    elif count >= 2 * len(_FIRST) and _directions(values[:, :3]):
        why, first = "its first three columns are directions of length 1, as of normals", 4
    elif count == 2 * len(_FIRST) and not (_directions(last) or _colours(last)):
        why, first = "it has six columns without names, and the last three are neither normals nor colours", 1
    else:
        return
    raise FormatError(path, f"line {layout.skip + 1}: {why}; {_what_to_write(path, first)}")


def _directions(values: Array) -> bool:
    return bool((np.abs(np.linalg.norm(values, axis=1) - 1.0) < _ROUNDED).all())


def _colours(values: Array) -> bool:
    whole = (values == np.round(values)).all() and values.max() <= _WHITE
    return bool(values.min() >= 0.0 and (whole or values.max() <= 1.0))
