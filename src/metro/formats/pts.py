"""Point clouds in PTS: blocks of a count line and so many lines ``x y z [intensity [red green blue]]``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from metro.formats.cloud import own_names, piece
from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw
from metro.formats.text import SPACES, Layout, number_pieces
from metro.units import Array

COLUMNS = ("x", "y", "z", "intensity", "red", "green", "blue")


def pts_pieces(path: Path, kind: Kind, rows: int | None) -> Iterator[Raw]:
    """Read all blocks of a PTS file as one cloud; intensity and colours are ignored.

    Raises
    ------
    FormatError
        Where a block does not start with its number of points, a line of it has fewer than three numbers, or
        the file ends within it.
    """
    own = own_names(path, kind, COLUMNS)
    due = 0
    for raw in number_pieces(path, Layout(COLUMNS, SPACES, 0), list(own.values()), rows):
        values = raw.frame.to_numpy()
        is_point, due = _points(path, values, due, raw.place)
        if due and (rows is None or len(values) < rows):
            break
        kept = np.flatnonzero(is_point)
        yield piece(own, raw.frame[is_point], partial(_place, raw.place, kept))
    if due:
        raise FormatError(path, f"ends early: its last block lacks {due} of its points")


def _place(place: Callable[[int], str], kept: np.ndarray, row: int) -> str:
    return place(int(kept[row]))


def _points(path: Path, values: Array, due: int, place: Callable[[int], str]) -> tuple[np.ndarray, int]:
    """Separate points from count lines: a mask (n,) of the lines ``values`` (n, 3), and how many are due.

    ``due`` points of a block that began earlier come first.
    """
    is_point = np.ones(len(values), dtype=bool)
    short = np.isfinite(values[:, 0]) & np.isnan(values[:, 2])
    row = 0
    while row < len(values):
        if not due:
            due = _count(path, values[row], partial(place, row))
            is_point[row] = False
            row += 1
        size = min(due, len(values) - row)
        if short[row : row + size].any():
            read = int(np.argmax(short[row : row + size]))
            message = f"{place(row + read)}: found fewer than three numbers, expected a point x y z"
            raise FormatError(path, f"{message} ({due - read} points of the block were still to come)")
        row, due = row + size, due - size
    return is_point, due


def _count(path: Path, line: Array, place: Callable[[], str]) -> int:
    if np.isnan(line[0]) or not np.isnan(line[1]) or line[0] < 0 or line[0] % 1:
        numbers = " ".join(f"{value:g}" for value in line if not np.isnan(value)) or "no number"
        hint = "a list of points without their number is an .xyz file"
        raise FormatError(
            path, f"{place()}: found {numbers}, expected the number of points of a block; {hint}"
        )
    return int(line[0])
