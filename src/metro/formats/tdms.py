"""Signals in TDMS, as National Instruments describes it in "TDMS File Format Internal Structure" (5696).

A file is a row of segments: a lead-in, what is new of the objects (properties, and how many values of which
type follow), and the raw values. Read are numbers in any byte order, contiguous or interleaved; refused are
raw values of DAQmx and values that still await NI's scaling. The common library, npTDMS, is the tests' other
program and not the reader: it would read those two, but also what there is of a file that is cut off, without
a word, and it trusts the sizes that a damaged file states.
"""

from __future__ import annotations

import mmap
import re
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from metro.formats.channels import Channel, Clock, channel_pieces
from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw

START = b"TDSm"

_METADATA, _NEW_LIST, _RAW, _INTERLEAVED, _BIG_ENDIAN, _DAQMX = (1 << bit for bit in (1, 2, 3, 5, 6, 7))
_LEAD_IN = 28
_VERSIONS = (4712, 4713)
_UNCLOSED = (1 << 64) - 1
_NO_VALUES, _AS_BEFORE, _DAQMX_INDEX = 0xFFFFFFFF, 0, (0x1269, 0x1369)
_STRING = 0x20
# Type → its NumPy code; 0x19 and 0x1A are floats with a unit, 0x44 a time stamp.
_TYPES = dict(enumerate(("i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f4", "f8"), start=1))
_TYPES |= {0x19: "f4", 0x1A: "f8", 0x21: "u1", 0x44: "V16", 0x08000C: "c8", 0x10000D: "c16"}
_PATH = re.compile(r"/'((?:[^']|'')*)'/'((?:[^']|'')*)'")
_SAVE_AGAIN = "save it again as scaled values, or export it as CSV"


@dataclass
class _Object:
    """The file, a group or a channel: its properties, how its values lie in a chunk, and the values."""

    path: str
    properties: dict[str, object] = field(default_factory=dict)
    index: tuple[int, int, int] | None = None  # type, values and bytes in a chunk
    pieces: list[np.ndarray] = field(default_factory=list)  # each (chunks, values in a chunk)

    def load(self, some: slice) -> np.ndarray:
        """Return some of the values."""
        first, last, _ = some.indices(sum(piece.size for piece in self.pieces))
        taken, begun = [np.empty(0)], 0
        for piece in self.pieces:
            start, stop = max(first - begun, 0), min(last - begun, piece.size)
            if start < stop:
                chunk = start // piece.shape[1]
                near = piece[chunk : -(-stop // piece.shape[1])].reshape(-1)
                taken.append(near[start - chunk * piece.shape[1] :][: stop - start])
            begun += piece.size
        return np.concatenate(taken)


class _Values(NamedTuple):
    data: np.ndarray  # of uint8
    order: str
    interleaved: bool


class _Cursor:
    """Reads numbers and texts one after the other, never beyond its end."""

    def __init__(self, path: Path, data: np.ndarray, span: tuple[int, int], order: str) -> None:
        self.path, self.data, (self.at, self.end), self.order = path, data, span, order

    def bytes(self, size: int) -> bytes:
        if self.at + size > self.end:
            message = f"is damaged: its description ends within a value at byte {self.at}"
            raise FormatError(self.path, f"{message}; copy it again from the recorder")
        self.at += size
        return self.data[self.at - size : self.at].tobytes()

    def number(self, code: str) -> int:
        return int(struct.unpack(self.order + code, self.bytes(struct.calcsize(code)))[0])

    def text(self) -> str:
        return self.bytes(self.number("I")).decode("utf-8", errors="replace")

    def property(self) -> tuple[str, object]:
        name, kind = self.text(), self.number("I")
        if kind == _STRING:
            return name, self.text()
        dtype = _dtype(self.path, kind, self.order, f"property {name!r}")
        value = np.frombuffer(self.bytes(dtype.itemsize), dtype)[0]
        return name, value.tobytes() if dtype.kind == "V" else value.item()


def _dtype(path: Path, kind: int, order: str, what: str) -> np.dtype:
    if kind not in _TYPES:
        raise FormatError(path, f"{what}: found the data type {kind:#x}, expected numbers; {_SAVE_AGAIN}")
    return np.dtype(order + _TYPES[kind])


def tdms_pieces(path: Path, kind: Kind, rows: int | None) -> Iterator[Raw]:
    """Read the channels of all groups that are columns of a kind in pieces; other channels are ignored.

    A channel's unit is its property ``unit_string``. Where no channel is the time, it is that of the
    waveforms, ``wf_start_offset`` and ``wf_increment``, which must be the same for all that are read.

    Raises
    ------
    FormatError
        As :func:`metro.formats.channels.channel_pieces`, and where the file is damaged or cut off, or holds
        values that are not scaled.
    """
    with path.open("rb") as stream:
        mapped = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
    for piece in channel_pieces(path, kind, _channels_of(path, mapped), rows):
        yield piece
        mapped.madvise(mmap.MADV_DONTNEED)  # pages that were read would count as this process's memory


@contextmanager
def tdms_channels(path: Path) -> Iterator[list[Channel]]:
    """Open a file and give the channels of all its groups."""
    with path.open("rb") as stream:
        mapped = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
    yield _channels_of(path, mapped)


def _channels_of(path: Path, mapped: mmap.mmap) -> list[Channel]:
    objects = _objects(path, np.frombuffer(mapped, dtype=np.uint8))
    return [one for each in objects.values() for one in _channels(each)]


def _channels(one: _Object) -> Iterator[Channel]:
    """Yield the channel that an object is, if it is one that has values."""
    names = _PATH.fullmatch(one.path)
    if names is None or one.index is None:
        return
    group, name = (part.replace("''", "'") for part in names.groups())
    unit = str(one.properties.get("unit_string", ""))
    if one.properties.get("NI_Number_Of_Scales") and one.properties.get("NI_Scaling_Status") != "scaled":
        unit = "raw counts"  # which no column is in: the channel is refused where it is asked for
    numeric = one.index[0] != _STRING and all(piece.dtype.kind in "iuf" for piece in one.pieces)
    size = sum(piece.size for piece in one.pieces)
    yield Channel(f"channel {group}/{name}", name, unit, (size,), numeric, one.load, _clock(one.properties))


def _clock(properties: dict[str, object]) -> Clock | None:
    """Return the clock of a waveform's properties; None where they have none in seconds."""
    step, offset = properties.get("wf_increment"), properties.get("wf_start_offset", 0.0)
    if not (isinstance(step, float) and isinstance(offset, float) and step > 0.0):
        return None
    start = properties.get("wf_start_time", b"")
    seconds = properties.get("wf_xunit_string", "s") in ("s", "")
    return Clock(offset, step, start if isinstance(start, bytes) else b"") if seconds else None


def _objects(path: Path, data: np.ndarray) -> dict[str, _Object]:
    """Walk over the segments; give every object by its path."""
    objects: dict[str, _Object] = {}
    listed: dict[str, _Object] = {}  # those with values in the segment, in their order
    for number, (at, flags, raw, end) in enumerate(_segments(path, data), start=1):
        order = ">" if flags & _BIG_ENDIAN else "<"
        place = f"segment {number} at byte {at}"
        if flags & _DAQMX:
            raise FormatError(
                path, f"{place}: found raw values of DAQmx, expected scaled ones; {_SAVE_AGAIN}"
            )
        if flags & _METADATA:
            if flags & _NEW_LIST:
                listed = {}
            _describe(_Cursor(path, data, (at + _LEAD_IN, raw), order), objects, listed)
        if flags & _RAW:
            _take(
                path, place, _Values(data[raw:end], order, bool(flags & _INTERLEAVED)), list(listed.values())
            )
    return objects


def _segments(path: Path, data: np.ndarray) -> Iterator[tuple[int, int, int, int]]:
    """Yield of each segment where it starts, its flags, where its values start, and where it ends."""
    at = 0
    while at < len(data):
        head = data[at : at + _LEAD_IN].tobytes()
        if len(head) < _LEAD_IN or head[:4] != START:
            message = f"is damaged or ends early: found no segment at byte {at}"
            raise FormatError(path, f"{message}, expected one that starts with TDSm; copy it again")
        (flags,) = struct.unpack("<I", head[4:8])
        version, following, raw = struct.unpack((">" if flags & _BIG_ENDIAN else "<") + "IQQ", head[8:])
        if version not in _VERSIONS:
            raise FormatError(path, f"found TDMS of version {version}, expected one of {_VERSIONS}")
        if following == _UNCLOSED:
            message = f"its last segment, at byte {at}, was not closed: the recorder stopped while it wrote"
            raise FormatError(path, f"{message}; open and save it once with the recorder's program")
        start, end = at + _LEAD_IN + raw, at + _LEAD_IN + following
        if end > len(data) or start > end:
            message = f"ends early: found {len(data)} bytes, expected a segment to end at byte {end}"
            raise FormatError(path, f"{message}; copy it again from the recorder")
        yield at, flags, start, end
        at = end


def _describe(cursor: _Cursor, objects: dict[str, _Object], listed: dict[str, _Object]) -> None:
    """Read a segment's description of its objects; keep the list of those that have values in it."""
    for _ in range(cursor.number("I")):
        path = cursor.text()
        one = objects.setdefault(path, _Object(path))
        index = cursor.number("I")
        if index in _DAQMX_INDEX:
            message = f"{path}: found raw values of DAQmx, expected scaled ones; {_SAVE_AGAIN}"
            raise FormatError(cursor.path, message)
        if index == _NO_VALUES:
            listed.pop(path, None)
        else:
            if index != _AS_BEFORE:
                _index(cursor, one)
            elif one.index is None:
                raise FormatError(cursor.path, f"{path}: is damaged: its values are not described")
            if one.index is not None and one.index[1]:
                listed[path] = one
            else:
                listed.pop(path, None)
        one.properties |= dict(cursor.property() for _ in range(cursor.number("I")))


def _index(cursor: _Cursor, one: _Object) -> None:
    kind, dimension, count = cursor.number("I"), cursor.number("I"), cursor.number("Q")
    if dimension != 1:
        raise FormatError(cursor.path, f"{one.path}: found {dimension} dimensions, expected 1; {_SAVE_AGAIN}")
    if kind == _STRING:
        one.index = kind, count, cursor.number("Q")
    else:
        one.index = kind, count, count * _dtype(cursor.path, kind, cursor.order, one.path).itemsize


def _take(path: Path, place: str, values: _Values, listed: list[_Object]) -> None:
    """Give the objects of a segment their values: it has as many chunks of all of them as fit."""
    if not len(values.data):
        return
    filled = [(one, one.index) for one in listed if one.index is not None]
    chunk = sum(size for _, (_, _, size) in filled)
    if not chunk or len(values.data) % chunk:
        message = f"{place}: found {len(values.data)} bytes of values, expected a multiple of {chunk}"
        raise FormatError(path, f"{message}; copy it again from the recorder")
    chunks, offset = len(values.data) // chunk, 0
    if values.interleaved and (
        len({count for _, (_, count, _) in filled}) > 1 or any(kind == _STRING for _, (kind, _, _) in filled)
    ):
        message = "found interleaved texts or channels of several lengths, expected numbers of one length"
        raise FormatError(path, f"{place}: {message}; {_SAVE_AGAIN}")
    for one, (kind, count, size) in filled:
        if kind != _STRING:
            dtype = _dtype(path, kind, values.order, one.path)
            step = chunk // count if values.interleaved else dtype.itemsize
            one.pieces.append(np.ndarray((chunks, count), dtype, values.data.data, offset, (chunk, step)))
        offset += size // count if values.interleaved else size
