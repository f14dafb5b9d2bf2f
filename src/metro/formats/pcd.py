"""Point clouds in PCD: ascii, binary and compressed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from metro.formats.cloud import points
from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw
from metro.formats.text import SPACES, Layout, numbers

_KEYS = ("fields", "size", "type", "points", "data")
_ENCODINGS = ("ascii", "binary", "binary_compressed")
_LONGEST_HEADER = 100


@dataclass(frozen=True)
class Header:
    """Encoding, number of points, record of one point, its columns in ascii, and the header's length."""

    encoding: str
    points: int
    record: np.dtype[np.void]
    columns: tuple[str, ...]
    lines: int
    size: int


def read_pcd(path: Path, kind: Kind, rows: int | None) -> Raw:
    """Read the coordinates of a PCD file; other fields are ignored.

    Raises
    ------
    FormatError
        Where the header is not one of a PCD file, x, y or z is missing, or the file ends early.
    """
    header = read_header(path)
    names = list(header.columns)
    count = header.points if rows is None else min(rows, header.points)
    if header.encoding == "ascii":
        layout = Layout(header.columns, SPACES, header.lines)
        raw = points(path, kind, names, lambda use: numbers(path, layout, use, count))
    elif header.encoding == "binary":
        data = np.fromfile(path, header.record, count, offset=header.size)
        raw = points(path, kind, names, lambda use: {name: data[name] for name in use})
    else:
        coordinates = _decompressed(path)[:count]
        raw = points(path, kind, names, lambda use: {name: coordinates[:, "xyz".index(name)] for name in use})
    if len(raw.frame) < count:
        raise FormatError(path, f"ends early: found {len(raw.frame)} points, expected {header.points}")
    return raw


def read_header(path: Path) -> Header:
    """Read the header of a PCD file up to ``DATA``."""
    entries: dict[str, list[str]] = {}
    number = 0
    with path.open("rb") as stream:
        while "data" not in entries and number < _LONGEST_HEADER:
            number += 1
            words = stream.readline(4096).decode("ascii", errors="replace").split()
            if words and not words[0].startswith("#"):
                entries[words[0].lower()] = words[1:]
        size = stream.tell()
    missing = [key.upper() for key in _KEYS if not entries.get(key)]
    if missing:
        raise FormatError(path, f"lacks {', '.join(missing)} in the header of a PCD file")
    encoding = entries["data"][0]
    if encoding not in _ENCODINGS:
        raise FormatError(path, f"DATA: found {encoding!r}, expected {', '.join(_ENCODINGS)}")
    try:
        record, columns = _fields(entries)
        return Header(encoding, int(entries["points"][0]), record, columns, number, size)
    except (TypeError, ValueError) as error:
        message = "FIELDS, SIZE, TYPE, COUNT and POINTS of the header disagree"
        raise FormatError(path, f"{message}: {error}") from error


def _fields(entries: dict[str, list[str]]) -> tuple[np.dtype[np.void], tuple[str, ...]]:
    """Build the record of a point (binary) and the names of its columns (ascii)."""
    record: list[tuple[str, str, int]] = []
    columns: list[str] = []
    repeats = entries.get("count", ["1"] * len(entries["fields"]))
    described = zip(entries["fields"], entries["size"], entries["type"], repeats, strict=True)
    for index, (name, width, letter, repeat) in enumerate(described):
        # padding fields are all called "_", and a record wants each name once
        label = f"_{index}" if name == "_" else name
        record.append((label, f"<{letter.lower()}{width}", int(repeat)))
        columns += [label if copy == 0 else f"{label}.{copy}" for copy in range(int(repeat))]
    return np.dtype([field if field[2] > 1 else field[:2] for field in record]), tuple(columns)


def _decompressed(path: Path) -> npt.NDArray[np.float64]:
    """Let Open3D undo the LZF compression."""
    import open3d

    return np.asarray(open3d.io.read_point_cloud(path, format="pcd").points)
