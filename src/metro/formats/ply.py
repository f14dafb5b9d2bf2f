"""Point clouds in PLY: ascii and binary of either byte order."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from metro.formats.cloud import counted, own_names, piece, point_count, record_pieces
from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw
from metro.formats.text import SPACES, Layout, number_pieces

_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8",
}  # fmt: skip
_BYTE_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
_LONGEST_HEADER = 1000


@dataclass(frozen=True)
class Header:
    """Encoding, number of vertices, their properties (name, NumPy type), and the header's length."""

    encoding: str
    vertices: int
    properties: tuple[tuple[str, str], ...]
    lines: int
    size: int


def ply_pieces(path: Path, kind: Kind, rows: int | None) -> Iterator[Raw]:
    """Read the coordinates of the vertices; other properties and other elements are ignored.

    Raises
    ------
    FormatError
        Where the header is not one of a PLY file, the vertices do not come first, have no x, y, z or hold a
        list, or where the file ends before its last vertex.
    """
    header = read_header(path)
    names = [name for name, _ in header.properties]
    own = own_names(path, kind, names)
    if header.encoding == "ascii":
        layout = Layout(tuple(names), SPACES, header.lines)
        raw_pieces = number_pieces(path, layout, list(own.values()), rows, header.vertices)
        pieces: Iterator[Raw] = (piece(own, raw.frame, raw.place) for raw in raw_pieces)
    else:
        order = _BYTE_ORDERS[header.encoding]
        record = np.dtype([(name, order + code) for name, code in header.properties])
        pieces = record_pieces(path, own, record, rows, offset=header.size, count=header.vertices)
    yield from counted(path, "vertices", pieces, rows, header.vertices)


def read_header(path: Path) -> Header:
    """Read the header of a PLY file up to ``end_header``."""
    encoding, elements, properties = "", [], []
    with path.open("rb") as stream:
        for number in range(1, _LONGEST_HEADER):
            words = stream.readline(4096).decode("ascii", errors="replace").split()
            match words:
                case ["format", name, "1.0"]:
                    encoding = name
                case ["element", name, count] if _is_count(count):
                    elements.append((name, point_count(count)))
                case ["property", *described] if len(elements) == 1:
                    properties.append(_property(path, number, described))
                case ["end_header"]:
                    break
                case ["ply"] | ["comment", *_] | ["obj_info", *_] | ["property", *_]:
                    pass
                case _:
                    text = " ".join(words)[:60]
                    raise FormatError(path, f"line {number}: found {text!r} in the header of a PLY file")
        size = stream.tell()
    if encoding != "ascii" and encoding not in _BYTE_ORDERS:
        expected = ", ".join(("ascii", *_BYTE_ORDERS))
        raise FormatError(path, f"found the PLY format {encoding!r}, expected {expected} 1.0")
    if not elements or elements[0][0] != "vertex":
        text = elements[0][0] if elements else "none"
        raise FormatError(path, f"first element: found {text}, expected vertex before any other")
    names = [name for name, _ in properties]
    if not names or len(set(names)) < len(names):
        raise FormatError(path, f"found the vertex properties {names}, expected each once")
    return Header(encoding, elements[0][1], tuple(properties), number, size)


def _is_count(text: str) -> bool:
    try:
        return point_count(text) >= 0
    except ValueError:
        return False


def _property(path: Path, number: int, words: list[str]) -> tuple[str, str]:
    match words:
        case [code, name] if code in _TYPES:
            return name, _TYPES[code]
    text = " ".join(words)
    raise FormatError(
        path, f"line {number}: found the vertex property {text!r}, expected a number type and a name"
    )
