"""Variables of MATLAB files of versions 5 to 7, as MathWorks describes them in "MAT-File Format".

Numbers, texts and single structures are read; other classes are named, never built, and nothing is run.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from metro.formats.errors import FormatError
from metro.formats.limits import LARGEST, check_unpacked

START = b"MATLAB 5.0 MAT-file"

_HEADER, _ORDER_AT = 128, 126
_MATRIX, _COMPRESSED = 14, 15
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TEXT_TYPES = {2: "utf-8", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_STRUCTURE, _TEXT, _NUMBERS, _COMPLEX = 2, 4, range(6, 16), 0x800
_CLASSES = {1: "cell array", 3: "object", 5: "sparse matrix", 16: "function", 17: "table or object"}
_DEEPEST = 4  # structures in structures


COMPLEX = "complex numbers"  # kind of a variable


@dataclass(frozen=True)
class Variable:
    """A variable or a field of a structure.

    Attributes
    ----------
    name : its name.
    shape : of its values, () where it has none.
    kind : ``numbers``, or in words what else it is.
    load : gives some of its numbers, column by column.
    text : of a text.
    fields : of a structure.
    """

    name: str
    shape: tuple[int, ...] = ()
    kind: str = "numbers"
    load: Callable[[slice], np.ndarray] = lambda _: np.empty(0)
    text: str | None = None
    fields: tuple[Variable, ...] = ()


class _Element(NamedTuple):
    """A data element: its type, where its data begin and end, and where the next element begins."""

    type: int
    start: int
    end: int
    following: int


class _Elements:
    """Elements one after the other in bytes, from one place to another."""

    def __init__(self, path: Path, data: bytes, span: tuple[int, int], order: str) -> None:
        self.path, self.data, (self.at, self.end), self.order = path, data, span, order

    def damaged(self, what: str) -> FormatError:
        fault = f"is damaged or ends early: {what} at byte {self.at} of {len(self.data)}"
        return FormatError(self.path, f"{fault}, expected whole variables; save it again with '-v7'")

    def next(self) -> _Element:
        """Pass over the next element; it lies within the end."""
        if self.at + 8 > self.end:
            raise self.damaged("found no element")
        kind, size = np.frombuffer(self.data, f"{self.order}u4", 2, self.at).tolist()
        if kind >> 16:  # number of bytes and type in one word, and up to four bytes of data
            kind, size, start, following = kind & 0xFFFF, kind >> 16, self.at + 4, self.at + 8
        else:
            start = self.at + 8
            following = start + size + (0 if kind == _COMPRESSED else -size % 8)
        if start + size > min(self.end, following):
            raise self.damaged(f"found an element of {size} bytes")
        self.at = min(following, self.end)  # the last need not be padded
        return _Element(kind, start, start + size, following)

    def numbers(self) -> np.ndarray:
        """Return the numbers of the next element, (n,), of the type that they are stored in."""
        element = self.next()
        dtype = np.dtype(self.order + _TYPES.get(element.type, "V1"))
        if dtype.kind == "V" or (element.end - element.start) % dtype.itemsize:
            raise self.damaged(f"found data of type {element.type}, no numbers")
        count = (element.end - element.start) // dtype.itemsize
        return np.frombuffer(self.data, dtype, count, element.start)

    def text(self) -> str:
        """Return the text of the next element."""
        element = self.next()
        encoding = _TEXT_TYPES.get(element.type, "latin-1")
        order = {"<": "-le", ">": "-be"}[self.order] if encoding in ("utf-16", "utf-32") else ""
        return self.data[element.start : element.end].decode(encoding + order, errors="replace")

    def inner(self) -> _Elements | None:
        """Return the elements of the next matrix; None where it is another element."""
        element = self.next()
        span = element.start, element.end
        return _Elements(self.path, self.data, span, self.order) if element.type == _MATRIX else None


def variables_of(path: Path, title: str) -> Iterator[Variable]:
    """Yield all variables of a file; what they unpack to is counted while it is unpacked.

    Raises
    ------
    FormatError
        Where the file is damaged or cut off, or unpacks to more than a recording can be.
    """
    data = path.read_bytes()
    order = {b"IM": "<", b"MI": ">"}.get(data[_ORDER_AT:_HEADER])
    outer = _Elements(path, data, (min(_HEADER, len(data)), len(data)), order or "<")
    if order is None:
        raise outer.damaged("found no header of 128 bytes, it ends")
    left = LARGEST
    while outer.at < outer.end:
        before = outer.at
        element = outer.next()
        elements = _Elements(path, data, (before, outer.at), order)
        if element.type == _COMPRESSED:
            packed = zlib.decompressobj()
            try:
                inner = packed.decompress(data[element.start : element.end], left + 1)
            except zlib.error as error:
                raise elements.damaged(f"cannot unpack a variable ({error})") from error
            left -= len(inner)
            check_unpacked(path, LARGEST - left, title)
            if not packed.eof:
                raise elements.damaged("cannot unpack a variable (it is not whole)")
            elements = _Elements(path, inner, (0, len(inner)), order)
        matrix = elements.inner()
        if matrix is not None:
            yield _variable(matrix, None, 0)


def _variable(elements: _Elements, name: str | None, depth: int) -> Variable:
    """Read a matrix: flags, dimensions, name (fields have none, theirs is given), and what its class has."""
    flags = elements.numbers()
    if len(flags) != 2:
        raise elements.damaged("found no array flags")
    kind, word = int(flags[0]) & 0xFF, int(flags[0])
    if kind in (16, 17):  # these are laid out otherwise, and only MATLAB can read them
        return Variable(name or elements.text(), kind=_CLASSES[kind])
    shape = tuple(int(size) for size in elements.numbers())
    own = elements.text()
    name = own if name is None else name
    if min(shape, default=-1) < 0:
        raise elements.damaged(f"variable {name}: found dimensions {shape}")
    if kind == _STRUCTURE and math.prod(shape) == 1 and depth < _DEEPEST:
        return Variable(name, shape, "structure", fields=tuple(_fields(elements, depth)))
    if kind == _TEXT:
        return Variable(name, shape, "text", text=elements.text() if math.prod(shape) else "")
    if kind in _NUMBERS:
        real = _numbers(elements, name, shape)
        if not word & _COMPLEX:
            return Variable(name, shape, load=lambda some: real[some])
        imaginary = _numbers(elements, name, shape)
        return Variable(name, shape, COMPLEX, lambda some: real[some] + 1j * imaginary[some])
    return Variable(name, shape, _CLASSES.get(kind, "array of structures"))


def _numbers(elements: _Elements, name: str, shape: tuple[int, ...]) -> np.ndarray:
    values = elements.numbers()
    if len(values) != math.prod(shape):
        raise elements.damaged(f"variable {name}: found {len(values)} numbers, expected {math.prod(shape)},")
    return values


def _fields(elements: _Elements, depth: int) -> Iterator[Variable]:
    """Read the fields of a single structure: the length of their names, the names, and a matrix each."""
    (length,) = elements.numbers()[:1].tolist() or (0,)
    text = elements.text()
    if length < 1 or len(text) % length:
        raise elements.damaged(f"found names of fields of {length} characters")
    for at in range(0, len(text), length):
        inner = elements.inner()
        if inner is None:
            raise elements.damaged("found no field of a structure")
        name = text[at : at + length].partition("\0")[0]
        if inner.at == inner.end:
            yield Variable(name, (0, 0))  # an empty matrix may be written as nothing at all
        else:
            yield _variable(inner, name, depth + 1)
