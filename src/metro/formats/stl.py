"""Triangle meshes in STL, ASCII and binary, as the cloud of their vertices, each once.

A file of triangles names a vertex once per triangle that meets there, about six times: kept so, the same
point would weigh six times in a plane, and a noise estimate would think the points are correlated.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from metro.formats.cloud import number_of, piece, slices
from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw
from metro.formats.text import is_number, lines
from metro.units import Array

_HEADER = 80
_FACET = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])
_OWN = {"x_mm": "x", "y_mm": "y", "z_mm": "z"}


def stl_pieces(path: Path, _kind: Kind, rows: int | None) -> Iterator[Raw]:
    """Read the vertices of all facets, each once, sorted by x, y, z; the mesh is in memory as a whole.

    Raises
    ------
    FormatError
        Where an ASCII file has a facet without three vertices or no ``endsolid``, where a binary one is not
        as long as its number of facets requires, or where it is neither.
    """
    vertices = _unique(_ascii(path) if _is_ascii(path) else _binary(path))
    for part in slices(len(vertices), rows):
        columns = dict(zip("xyz", vertices[part].T, strict=True))
        yield piece(_OWN, columns, partial(number_of, part.start))


def _is_ascii(path: Path) -> bool:
    """Distinguish the encodings; the header of a binary file may start with ``solid``, too."""
    with path.open("rb") as stream:
        head = stream.read(1024)
    return head.lstrip().startswith(b"solid") and b"\0" not in head


def _binary(path: Path) -> Array:
    size = path.stat().st_size
    if size < _HEADER + 4:
        raise FormatError(path, f"ends early: found {size} bytes, expected {_HEADER + 4} before the facets")
    count = int(np.fromfile(path, "<u4", 1, offset=_HEADER)[0])
    there = (size - _HEADER - 4) / _FACET.itemsize
    if there < count:
        raise FormatError(path, f"ends early: found {int(there)} facets, expected {count}")
    if there > count:
        raise FormatError(path, f"found {size} bytes, expected those of {count} facets, as its header says")
    facets = np.fromfile(path, _FACET, count, offset=_HEADER + 4)
    return facets["vertices"].reshape(-1, 3).astype(np.float64)


def _ascii(path: Path) -> Array:
    vertices: list[list[float]] = []
    last, number = "", 0
    for number, text in lines(path):
        words = text.split()
        last = words[0].lower() if words else last  # a line of control characters holds nothing
        if last == "vertex":
            if len(words) != 4 or not all(map(is_number, words[1:])):
                raise FormatError(path, f"line {number}: found {text!r}, expected vertex x y z")
            vertices.append([float(word) for word in words[1:]])
        elif last == "endloop" and (len(vertices) % 3 or not vertices):
            raise FormatError(
                path, f"line {number}: found a facet that has not three vertices, expected three"
            )
    if last != "endsolid" or len(vertices) % 3:
        raise FormatError(path, f"ends early: found {last!r} on its last line {number}, expected endsolid")
    return np.array(vertices, dtype=np.float64).reshape(-1, 3)


def _unique(vertices: Array) -> Array:
    """Keep one of each group of equal vertices (n, 3)."""
    ordered = vertices[np.lexsort(vertices.T[::-1])]
    new = np.ones(len(ordered), dtype=bool)
    new[1:] = (np.diff(ordered, axis=0) != 0).any(axis=1)
    return ordered[new]
