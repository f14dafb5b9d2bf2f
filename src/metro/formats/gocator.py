"""Range images of LMI Gocator sensors as CSV: blocks of settings, and a grid of heights with its x and y."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw
from metro.formats.text import lines

STARTS = (b"Info\r\nCSV Version", b"Info\nCSV Version")
_CORNER = "Y\\X"
_NONE = ("", "-")  # of a point without a height


def read_gocator(path: Path, kind: Kind, rows: int | None) -> Raw:
    """Read all heights of the first surface, in millimetres; points without a height are left out.

    Raises
    ------
    FormatError
        Where there is no grid, a row has not as many heights as the grid has columns, or one is no number.
    """
    grid = _grid(path, kind)
    _, first = next(grid)
    x = _numbers(path, 0, first[1:])
    points = [np.empty((0, 3))]
    found = 0
    for number, row in grid:
        if len(row) != len(first):
            fault = f"found {len(row) - 1} heights, expected {len(x)} as in the line of x"
            raise FormatError(path, f"line {number}: {fault}")
        y, z = _numbers(path, number, row[:1])[0], _numbers(path, number, row[1:])
        there = np.isfinite(z)
        points.append(np.column_stack([x[there], np.full(there.sum(), y), z[there]]))
        found += len(points[-1])
        if rows is not None and found >= rows:
            break
    table = np.concatenate(points)[:rows]
    return Raw(pd.DataFrame(table, columns=["x_mm", "y_mm", "z_mm"]), lambda row: f"point {row + 1}")


def _grid(path: Path, kind: Kind) -> Iterator[tuple[int, list[str]]]:
    """Yield the line of x and the lines of heights, with their numbers, up to the end of the block."""
    within = False
    for number, text in lines(path):
        row = next(csv.reader([text]))
        row = row[:-1] if not row[-1] and row[0] == _CORNER else row
        within = within or row[0] == _CORNER
        if within and row[0] == "End":
            return
        if within:
            yield number, row
    if not within:
        raise FormatError(
            path, f"found no grid of heights (a line that begins with {_CORNER}) of {kind.title}"
        )


def _numbers(path: Path, number: int, cells: list[str]) -> np.ndarray:
    try:
        return np.array([np.nan if cell.strip() in _NONE else float(cell) for cell in cells])
    except ValueError as error:
        raise FormatError(path, f"line {number}: {error}, expected numbers") from error
