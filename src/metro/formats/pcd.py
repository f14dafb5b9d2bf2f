"""Point clouds in PCD: ascii, binary and compressed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from metro.formats.cloud import counted, number_of, own_names, piece, point_count, record_pieces, slices
from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw
from metro.formats.text import SPACES, Layout, number_pieces

_KEYS = ("fields", "size", "type", "points", "data")
_ENCODINGS = ("ascii", "binary", "binary_compressed")
_LONGEST_HEADER = 100
_WIDTHS = {"F": ("4", "8"), "I": ("1", "2", "4", "8"), "U": ("1", "2", "4", "8")}
MOST_UNPACKED = 132  # times its size: LZF repeats up to 264 bytes by two or three
_MOST_COPIES = 4096  # of a field in a point: the longest descriptors have some hundreds


@dataclass(frozen=True)
class Header:
    """Encoding, number of points, record of one point, its columns in ascii, and the header's length."""

    encoding: str
    points: int
    record: np.dtype[np.void]
    columns: tuple[str, ...]
    lines: int
    size: int


def pcd_pieces(path: Path, kind: Kind, rows: int | None) -> Iterator[Raw]:
    """Read the coordinates of a PCD file; other fields are ignored.

    Raises
    ------
    FormatError
        Where the header is not one of a PCD file, x, y or z is missing, or the file ends early.
    """
    header = read_header(path)
    own = own_names(path, kind, header.columns)
    wide = [name for name in own.values() if header.record[name].shape]
    if wide:
        raise FormatError(path, f"COUNT of {wide[0]}: found {header.record[wide[0]].shape[0]}, expected 1")
    if header.encoding == "ascii":
        layout = Layout(header.columns, SPACES, header.lines)
        raw_pieces = number_pieces(path, layout, list(own.values()), rows, header.points)
        pieces: Iterator[Raw] = (piece(own, raw.frame, raw.place) for raw in raw_pieces)
    elif header.encoding == "binary":
        pieces = record_pieces(path, own, header.record, rows, offset=header.size, count=header.points)
    else:
        _check_compressed(path, header)
        pieces = _decompressed(path, own, rows)
    yield from counted(path, "points", pieces, rows, header.points)


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
        points = point_count(entries["points"][0])
        return Header(encoding, points, record, columns, number, size)
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
        if width not in _WIDTHS.get(letter.upper(), ()) or not 1 <= int(repeat) <= _MOST_COPIES:
            raise ValueError(f"found {repeat} of TYPE {letter} and SIZE {width}")
        # padding fields are all called "_", and a record wants each name once
        label = f"_{index}" if name == "_" else name
        record.append((label, f"<{letter.lower()}{width}", int(repeat)))
        columns += [label if copy == 0 else f"{label}.{copy}" for copy in range(int(repeat))]
    return np.dtype([field if field[2] > 1 else field[:2] for field in record]), tuple(columns)


def _check_compressed(path: Path, header: Header) -> None:
    """Check the two sizes before the compressed points: Open3D believes them, and reads past their end."""
    sizes = np.fromfile(path, "<u4", 2, offset=header.size)
    expected = header.points * header.record.itemsize
    there = path.stat().st_size - header.size - sizes.nbytes
    if len(sizes) < 2 or sizes[0] > there or sizes[1] != expected or expected > MOST_UNPACKED * there:
        present = " and ".join(map(str, sizes)) or "none"
        message = f"ends early or is damaged: found the sizes {present} of the points packed and unpacked"
        raise FormatError(
            path, f"{message}, expected {header.points} points in {there} bytes, {expected} unpacked"
        )


def _decompressed(path: Path, own: Mapping[str, str], rows: int | None) -> Iterator[Raw]:
    """Let Open3D undo the LZF compression; the whole cloud is in memory then."""
    import open3d

    if strange := set(own.values()) - set("xyz"):
        unknown = ", ".join(sorted(strange))
        raise FormatError(path, f"DATA binary_compressed: found the columns {unknown}, expected x, y and z")
    coordinates = np.asarray(open3d.io.read_point_cloud(path, format="pcd").points)
    for part in slices(len(coordinates), rows):
        columns = {name: coordinates[part, "xyz".index(name)] for name in own.values()}
        yield piece(own, columns, partial(number_of, part.start))
