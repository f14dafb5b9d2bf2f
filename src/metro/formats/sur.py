"""Profiles and areal scans in SUR (Digital Surf, MountainsMap): a header of 512 bytes and whole numbers.

Little-endian throughout. Behind the header are a comment and a private zone, whose lengths the header states,
then the heights line by line: as they are, or packed by zlib ("DSCOMPRESSED").
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from metro.formats.errors import FormatError
from metro.formats.kinds import KINDS, Kind, Raw
from metro.formats.limits import LARGEST_ARCHIVE, check_unpacked
from metro.formats.measures import UNITS
from metro.formats.text import unpacked
from metro.units import Array

PLAIN, PACKED = b"DIGITAL SURF", b"DSCOMPRESSED"
STARTS = (PLAIN, PACKED)

_HEADER = 512
_TYPES = {1: "a profile", 2: "a surface"}
_NOT_MEASURED = 2  # a point without a height has a number this much below the least


class _Header(NamedTuple):
    """What the header says of the heights.

    ``bits`` of a number; ``least``: smallest number that is a height; ``steps`` along x, y, z in mm;
    ``skipped``: bytes of comment and private zone; ``packed``: bytes of the heights, where they are packed.
    """

    title: str
    gaps: bool
    bits: int
    least: int
    columns: int
    lines: int
    steps: tuple[float, float, float]
    skipped: int
    packed: bool


def read_sur(path: Path, kind: Kind, rows: int | None) -> Raw:
    """Read a profile or, as a cloud, a surface; places count from the first point, heights as recorded.

    Points without a height are left out of a surface and at the ends of a trace; within a trace they are an
    error, as in every other profile.

    Raises
    ------
    FormatError
        Where the file is cut short or damaged, holds several objects or none that is asked for, or a length
        has no unit that is known.
    """
    with unpacked(path) as stream:
        content = stream.read(LARGEST_ARCHIVE + 1)
    check_unpacked(path, len(content), kind.title, LARGEST_ARCHIVE)
    header = _header(path, content)
    areal = kind is KINDS["cloud"]
    if (header.title == "a surface") != areal:
        raise FormatError(path, f"found {header.title}, expected {kind.title}")
    z = _heights(path, content, header)
    dx, dy, _ = header.steps
    if areal:
        line, column = np.nonzero(np.isfinite(z))
        points = np.column_stack([dx * column, dy * line, z[line, column]])
        return Raw(
            pd.DataFrame(points[:rows], columns=["x_mm", "y_mm", "z_mm"]), lambda row: f"point {row + 1}"
        )
    measured = np.flatnonzero(np.isfinite(z[0]))
    first, last = (int(measured[0]), int(measured[-1]) + 1) if len(measured) else (0, 0)
    x = dx * np.arange(first, last)
    return Raw(
        pd.DataFrame({"x_mm": x, "z_mm": z[0, first:last]})[:rows], lambda row: f"point {first + row + 1}"
    )


def _header(path: Path, content: bytes) -> _Header:
    """Read the header; the numbers are the offsets of the fields."""
    if len(content) < _HEADER:
        raise FormatError(path, f"ends within its header, after {len(content)} of {_HEADER} bytes")
    objects, version, kind = struct.unpack_from("<3h", content, 14)
    (gaps,) = struct.unpack_from("<h", content, 86)
    bits, least, _most, columns, lines, points = struct.unpack_from("<h5i", content, 98)
    steps = struct.unpack_from("<3f", content, 120)
    comment, private = struct.unpack_from("<2H", content, 334)
    if version != 1 or objects != 1:
        raise FormatError(path, f"found {objects} objects of version {version}, expected one of version 1")
    if kind not in _TYPES:
        raise FormatError(path, f"found a SUR object of type {kind}, expected a profile or a surface")
    if bits not in (16, 32) or columns < 1 or lines < 1 or columns * lines != points:
        found = f"{lines} lines of {columns} points of {bits} bits, {points} in all"
        raise FormatError(path, f"header: found {found}, which do not agree")
    check_unpacked(path, points * bits // 8, _TYPES[kind], LARGEST_ARCHIVE)
    units = [_text(content[at : at + 16]) for at in (180, 196, 212)]
    used = range(3) if kind == 2 else (0, 2)  # a profile has no step along y
    factors = [_factor(path, "xyz"[i], units[i], steps[i]) if i in used else 0.0 for i in range(3)]
    x, y, z = (step * factor for step, factor in zip(steps, factors, strict=True))
    packed = content.startswith(PACKED)
    return _Header(
        _TYPES[kind], bool(gaps), bits, least, columns, lines, (x, y, z), comment + private, packed
    )


def _text(field: bytes) -> str:
    """Return a text of the header: newer programs write UTF-8, older ones Latin-1."""
    text = field.split(b"\0")[0]
    try:
        return text.decode().strip()
    except UnicodeDecodeError:
        return text.decode("latin-1").strip()


def _factor(path: Path, axis: str, unit: str, step: float) -> float:
    """Return the factor of a unit of length to mm."""
    if not (np.isfinite(step) and step > 0.0):
        raise FormatError(path, f"header: found a step of {step:g} along {axis}, expected one above zero")
    if unit not in UNITS["length"]:
        known = ", ".join(UNITS["length"])
        raise FormatError(path, f"header: found the unit {unit!r} along {axis}, expected one of {known}")
    return UNITS["length"][unit]


def _heights(path: Path, content: bytes, header: _Header) -> Array:
    """Return the heights (lines, columns), mm; NaN where nothing was measured."""
    size = header.lines * header.columns * header.bits // 8
    data = content[_HEADER + header.skipped :]
    data = _unpacked(path, data, size) if header.packed else data[:size]
    if len(data) != size:
        raise FormatError(path, f"ends within its heights, after {len(data)} of {size} bytes")
    numbers = np.frombuffer(data, f"<i{header.bits // 8}").reshape(header.lines, header.columns)
    heights = numbers * header.steps[2]
    if header.gaps:
        heights[numbers == header.least - _NOT_MEASURED] = np.nan
    return np.asarray(heights)


def _unpacked(path: Path, data: bytes, size: int) -> bytes:
    """Unpack heights: a count of streams, the lengths (unpacked, packed) of each, and the streams."""
    try:
        (count,) = struct.unpack_from("<I", data)
        lengths = [struct.unpack_from("<2I", data, 4 + 8 * i) for i in range(min(count, len(data) // 8))]
        at, parts = 4 + 8 * len(lengths), []
        for _, packed in lengths:
            parts.append(zlib.decompressobj().decompress(data[at : at + packed], size))
            at += packed
    except (struct.error, zlib.error) as error:
        raise FormatError(path, f"holds heights that cannot be unpacked: {error}") from error
    return b"".join(parts)
