"""Point clouds in E57 (ASTM E2807), read by pye57 (libE57Format): several scans, each with its pose.

The standard's unit of length is the metre. Pages carry checksums, which the library verifies.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from metro.formats.cloud import number_of, piece
from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw
from metro.formats.limits import LARGEST_XML, check_unpacked
from metro.formats.packets import Note
from metro.units import MM, Array

SIGNATURE = b"ASTM-E57"

_HEADER = struct.Struct("<8s2L4Q")  # signature, version, file length, offset and length of the XML, page size
_CHECKSUM, _POINT = 4, 24
_PAGE, _DEEPEST = 1024, 64
_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_STATE = {_CARTESIAN: "cartesianInvalidState", _SPHERICAL: "sphericalInvalidState"}
_OWN = {"x_mm": "x", "y_mm": "y", "z_mm": "z"}


def e57_pieces(path: Path, kind: Kind, rows: int | None) -> Iterator[Raw]:
    """Read the points of all scans, moved by their poses into the frame of the file, in millimetres.

    Points that a scan marks as invalid have no coordinates. A note of the first piece lists what was joined.

    Raises
    ------
    FormatError
        Where header, pages or XML are damaged, entities are declared, or a scan has neither Cartesian nor
        spherical coordinates.
    """
    import pye57

    _check_header(path)
    try:
        with pye57.E57(str(path)) as file:
            yield from _scans(path, file, rows, kind)
    except UnicodeDecodeError as error:  # the library's own message quotes a byte of the file
        raise _unreadable(path, error.object.decode(errors="replace")) from error
    except (pye57.libe57.E57Exception, RuntimeError, MemoryError) as error:
        raise _unreadable(path, str(error)) from error


def _unreadable(path: Path, said: str) -> FormatError:
    return FormatError(path, f"is not a readable E57 file: {' '.join(said.split())}")


def _check_header(path: Path) -> None:
    """Check the file's length, and that its XML declares no entities, which could unfold to any size."""
    with path.open("rb") as stream:
        head = stream.read(_HEADER.size)
        if len(head) < _HEADER.size:
            raise FormatError(
                path, f"ends early: found {len(head)} bytes, expected a header of {_HEADER.size}"
            )
        _, _, _, length, start, size, page = _HEADER.unpack(head)
        there = path.stat().st_size
        if there < length:
            raise FormatError(path, f"ends early: found {there} bytes, expected {length}")
        if page != _PAGE or size > LARGEST_XML or start > there:
            message = f"found an XML section of {size} bytes at {start} on pages of {page}"
            raise FormatError(path, f"{message}, expected at most {LARGEST_XML} on pages of {_PAGE}")
        stream.seek(start - start % page)
        pages = (start % page + size) // (page - _CHECKSUM) + 1
        held = b"".join(stream.read(page)[:-_CHECKSUM] for _ in range(pages))
        xml = held[start % page : start % page + size]
    _check_xml(path, xml)


def _check_xml(path: Path, xml: bytes) -> None:
    """Check that an XML section declares no entities and is not nested: the library would go down with it."""
    from xml.parsers import expat

    depth = 0
    parser = expat.ParserCreate()

    def declared(*_: object) -> None:
        raise FormatError(path, "its XML declares a document type, expected none")

    def begun(*_: object) -> None:
        nonlocal depth
        depth += 1
        if depth > _DEEPEST:
            raise FormatError(path, f"its XML is nested more than {_DEEPEST} deep, expected about ten")

    def ended(_: str) -> None:
        nonlocal depth
        depth -= 1

    parser.StartDoctypeDeclHandler, parser.StartElementHandler, parser.EndElementHandler = (
        declared,
        begun,
        ended,
    )
    try:
        parser.Parse(xml, True)
    except (expat.ExpatError, LookupError, ValueError) as error:
        raise FormatError(path, f"its XML section cannot be read: {error}") from error


def _scans(path: Path, file: Any, rows: int | None, kind: Kind) -> Iterator[Raw]:
    count = int(file.scan_count)
    if rows is None:
        said = sum(int(file.get_header(index).point_count) for index in range(count))
        check_unpacked(path, _POINT * said, kind.title)
    headers = [file.get_header(index) for index in range(count)]
    posed = sum(bool(header.has_pose()) for header in headers)
    note = Note(
        "joined scans", float(count), np.nan, True, f"{count} scans were joined, {posed} by their poses"
    )
    parts: Iterator[Array] = (points for header in headers for points in _points(path, file, header, rows))
    if rows is None:
        parts = iter([np.concatenate([np.empty((0, 3)), *parts])])
    start = 0
    for points in parts:
        raw = piece(_OWN, dict(zip("xyz", points.T, strict=True)), partial(number_of, start))
        if not start:
            raw.frame.attrs["notes"] = [note]
        start += len(points)
        yield raw
    if not start and rows is not None:
        yield piece(_OWN, dict(zip("xyz", np.empty((3, 0)), strict=True)), partial(number_of, 0))


def _points(path: Path, file: Any, header: Any, rows: int | None) -> Iterator[Array]:
    """Yield the points (n, 3) of a scan in mm, so many at a time."""
    fields = set(header.point_fields)
    names = next((group for group in _STATE if fields.issuperset(group)), None)
    if names is None:
        listed = ", ".join(header.point_fields)
        raise FormatError(path, f"found a scan with {listed}, expected {', '.join(_CARTESIAN)}")
    state = _STATE[names]
    turn, shift = _pose(header)
    wanted = [*names, *([state] if state in fields else [])]
    capacity = max(1, min(header.point_count, 8 * path.stat().st_size if rows is None else rows))
    data, buffers = file.make_buffers(wanted, capacity)
    reader = header.points.reader(buffers)
    stored = path.stat().st_size
    seen, most = (
        0,
        8 * stored,
    )  # a point of no bits, the same as all others, can be stated any number of times
    while size := reader.read():
        points = np.column_stack([data[name][:size] for name in names])
        if names is _SPHERICAL:
            points = _from_spherical(points)
        if state in data:
            points[data[state][:size] != 0] = np.nan
        seen += size
        if seen > most:
            raise FormatError(path, f"found more points than the {most} that its {stored} bytes can hold")
        yield (points @ turn.T + shift) / MM
    reader.close()


def _pose(header: Any) -> tuple[Array, Array]:
    """Return rotation (3, 3) and translation (3,) in m of a scan in the frame of the file."""
    turn, shift = np.eye(3), np.zeros(3)
    if not header.has_pose():
        return turn, shift
    pose = header["pose"]
    if pose.isDefined("translation"):
        shift = np.array([float(pose["translation"][name].value()) for name in "xyz"])
    if pose.isDefined("rotation"):
        w, x, y, z = (float(pose["rotation"][name].value()) for name in "wxyz")
        across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        turn += 2 * (w * across + across @ across) / (w * w + x * x + y * y + z * z)  # Rodrigues
    return turn, shift


def _from_spherical(points: Array) -> Array:
    """Range, azimuth from x towards y, elevation from the xy plane → x, y, z."""
    distance, azimuth, elevation = points.T
    across = distance * np.cos(elevation)
    return np.column_stack([across * np.cos(azimuth), across * np.sin(azimuth), distance * np.sin(elevation)])
