"""What the readers of point clouds share: coordinates in millimetres, float64."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw, columns_to_read

_DIGITS = 12  # of the number of points: more than any disk holds
_COORDINATE = re.compile(r"([xyz])(?:[\s_(\[]*(\w+)[)\]]?)?", re.IGNORECASE)


def coordinate(path: Path, name: str) -> str:
    """Give the contract's name of a coordinate (``X``, ``x [mm]`` → ``x_mm``); keep other names."""
    match = _COORDINATE.fullmatch(name.strip())
    if match is None:
        return name
    if match[2] in ("m", "um", "in", "cm"):
        raise FormatError(path, f"column {name}: found coordinates in {match[2]}, expected mm")
    return f"{match[1].lower()}_mm" if match[2] in (None, "mm") else name


def own_names(path: Path, kind: Kind, names: Sequence[str]) -> dict[str, str]:
    """Find the coordinates among the columns ``names`` of a file: contract's name → the file's own."""
    contract_names = [coordinate(path, name) for name in names]
    use = columns_to_read(path, kind, contract_names)
    own = dict(zip(contract_names, names, strict=True))
    return {name: own[name] for name in use}


def piece(
    own: Mapping[str, str], columns: pd.DataFrame | Mapping[str, np.ndarray], place: Callable[[int], str]
) -> Raw:
    """Give a piece of a cloud, float64 under the contract's names, from ``columns`` under the file's own."""
    values = {name: np.asarray(columns[key], np.float64) for name, key in own.items()}
    return Raw(pd.DataFrame(values, copy=False), place)


def number_of(start: int, row: int) -> str:
    """Name a point of a piece that begins after the first ``start`` points of its file."""
    return f"point {start + row + 1}"


def point_count(text: str) -> int:
    """Return a number of points as a header states it; raises ValueError where it is none that can be."""
    if not (text.isascii() and text.isdigit() and len(text) <= _DIGITS):
        raise ValueError(f"found {text[:40]!r}, expected a number of points")
    return int(text)


def slices(count: int, rows: int | None) -> Iterator[slice]:
    """Part ``count`` rows into pieces of so many, or into one of all; always at least one."""
    step = max(count, 1) if rows is None else rows
    return (slice(start, min(start + step, count)) for start in range(0, max(count, 1), step))


def record_pieces(
    path: Path,
    own: Mapping[str, str],
    record: np.dtype[np.void],
    rows: int | None,
    *,
    offset: int,
    count: int,
) -> Iterator[Raw]:
    """Read binary records, one a point, that begin at ``offset``: as many of ``count`` as are there.

    A map of the file per piece, so that a piece is in memory once, and what was read is let go.
    """
    there = max(0, min((path.stat().st_size - offset) // record.itemsize, count))
    for part in slices(there, rows):
        size = part.stop - part.start
        start = offset + part.start * record.itemsize
        data = np.memmap(path, record, "r", start, (size,)) if size else np.empty(0, record)
        yield piece(own, {name: data[name] for name in own.values()}, partial(number_of, part.start))


def counted(path: Path, what: str, pieces: Iterable[Raw], rows: int | None, count: int) -> Iterator[Raw]:
    """Pass on the pieces of a file that states how many points it has; one that ends early is an error.

    Raises
    ------
    FormatError
        With the piece that is shorter than asked for, not after it, so that a first look finds it, too.
    """
    points = 0
    for each in pieces:
        due = count - points if rows is None else min(rows, count - points)
        points += len(each.frame)
        if len(each.frame) < due:
            raise FormatError(path, f"ends early: found {points} {what}, expected {count}")
        yield each
