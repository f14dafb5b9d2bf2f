"""Columns of numbers in a text file: the one parser behind every text format."""

from __future__ import annotations

import csv
import gzip
import io
import re
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from metro.formats.errors import FormatError
from metro.formats.kinds import Raw
from metro.formats.limits import check_unpacked

SPACES = r"\s+"
DECIMAL_COMMA = "numbers need a decimal point: export again with '.' as decimal sign"
MIXED = "the first line of numbers has decimal commas: export again with '.' as decimal sign in all"
_GZIP = b"\x1f\x8b"
_UTF16 = (b"\xff\xfe", b"\xfe\xff")


def lines(path: Path, skip: int = 0) -> Iterator[tuple[int, str]]:
    """Yield the lines after the first ``skip`` that hold something, stripped, with their number from 1.

    Blank lines and lines that start with ``#`` hold nothing. Text is UTF-8, with or without byte order mark;
    what is not UTF-8 (a degree sign of another code page) is replaced, since no number is written with it.
    """
    with unpacked(path) as stream:
        if stream.peek(2)[:2] in _UTF16:
            raise FormatError(path, "found text in UTF-16, expected UTF-8: save it again as UTF-8 or ASCII")
        for number, line in enumerate(io.TextIOWrapper(stream, "utf-8-sig", "replace"), start=1):
            text = line.strip("\r\n ")
            if number > skip and text and not text.startswith("#"):
                yield number, text


@contextmanager
def unpacked(path: Path) -> Iterator[io.BufferedReader]:
    """Open a file for reading, unpacked where it is a gzip file by its content.

    Raises
    ------
    FormatError
        While it is read: where it is damaged, or unpacks to more than a recording can be.
    """
    with path.open("rb") as stream:
        packed = stream.peek(len(_GZIP))[: len(_GZIP)] == _GZIP
        if not packed:
            yield stream
            return
        try:
            yield io.BufferedReader(_Unpacked(path, gzip.GzipFile(fileobj=stream)))
        except (EOFError, gzip.BadGzipFile, zlib.error) as error:
            raise FormatError(path, f"cannot be unpacked: {error}") from error


class _Unpacked(io.RawIOBase):
    """The content of a gzip file, up to as many bytes as a recording can be."""

    def __init__(self, path: Path, content: gzip.GzipFile) -> None:
        super().__init__()
        self._path, self._content, self._size = path, content, 0

    def readable(self) -> bool:
        """Say that it can be read."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Read into a buffer."""
        data = self._content.read(len(buffer))
        buffer[: len(data)] = data
        self._size += len(data)
        check_unpacked(self._path, self._size, "a text file")
        return len(data)


def separator(path: Path, number: int, header: str) -> str:
    """Return what separates the columns of a header line: commas or tabs; semicolons are refused."""
    if ";" in header:
        message = f"line {number}: found columns parted by semicolons, expected commas; {DECIMAL_COMMA}"
        raise FormatError(path, f"{message} and ',' between columns")
    return "\t" if "\t" in header and "," not in header else ","


def fields(text: str, parted_by: str) -> list[str]:
    """Split a line into its fields, stripped, without quotes."""
    if parted_by == SPACES:
        return text.split()
    try:
        parts = next(csv.reader([text], delimiter=parted_by, skipinitialspace=True))
    except csv.Error:  # a field longer than any name or number
        parts = text.split(parted_by)
    return [field.strip() for field in parts]


def is_number(text: str) -> bool:
    """Return whether a field is a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


@dataclass(frozen=True)
class Layout:
    """How a text file holds its columns.

    Attributes
    ----------
    names : the file's columns in order.
    parted_by : the separator between columns: a character, or ``SPACES``.
    skip : how many lines of the file, comments included, come before the first row.
    decimal : the decimal sign, "." or ",".
    """

    names: tuple[str, ...]
    parted_by: str
    skip: int
    decimal: str = "."


def number_pieces(
    path: Path, layout: Layout, use: Sequence[str], rows: int | None, limit: int | None = None
) -> Iterator[Raw]:
    """Read the columns ``use`` of a text file as floats; the other columns may hold anything.

    They come in pieces of so many rows, all at once where None, ``limit`` rows together; there is always one.

    Raises
    ------
    FormatError
        With line and column where a field is not a number, or a line has more fields than the header.
    """
    start = 0
    try:
        for frame in _parse(path, layout, use, rows, limit=limit, dtype=np.float64):
            yield Raw(frame, partial(_place, path, layout, start))
            start += len(frame)
    except pd.errors.ParserError as error:
        raise FormatError(path, _ragged(str(error))) from error
    except ValueError as error:
        texts = _parse(path, layout, use, rows, limit=limit, dtype=str)
        row, column, field = _first_fault(texts, layout.decimal)
        hint = f"; {DECIMAL_COMMA}" if re.match(r"[-+]?\d+,\d", field) else ""
        hint = f"; {MIXED}" if layout.decimal == "," and "." in field else hint
        message = f"{_place(path, layout, 0, row)}, column {column}: found {field!r}, expected a number{hint}"
        raise FormatError(path, message) from error


def _place(path: Path, layout: Layout, start: int, row: int) -> str:
    number, _ = next(islice(lines(path, layout.skip), start + row, None))
    return f"line {number}"


def _parse(
    path: Path, layout: Layout, use: Sequence[str], rows: int | None, *, limit: int | None, dtype: type
) -> Iterator[pd.DataFrame]:
    with (
        unpacked(path) as stream,
        pd.read_csv(
            stream,
            sep=layout.parted_by,
            decimal=layout.decimal,
            header=None,
            names=_labels(path, layout, use),
            index_col=False,
            dtype=dict.fromkeys(use, dtype),
            skiprows=layout.skip,
            nrows=limit,
            iterator=True,
            comment="#",
            skipinitialspace=True,
            low_memory=False,
            encoding="utf-8-sig",
            encoding_errors="replace",
        ) as reader,
    ):
        if rows is None:
            yield reader.read(limit)[list(use)]
            return
        frame = _next_chunk(reader, rows)
        if frame is None:
            yield pd.DataFrame({name: np.empty(0) for name in use})
        while frame is not None:
            yield frame[list(use)]
            frame = _next_chunk(reader, rows)


def _next_chunk(reader: pd.io.parsers.TextFileReader, rows: int) -> pd.DataFrame | None:
    try:
        return reader.get_chunk(rows)
    except StopIteration:
        return None


def _labels(path: Path, layout: Layout, use: Sequence[str]) -> list[str]:
    """Give every field of the first row a unique label; a row of more fields than names is an error."""
    number, first = next(lines(path, layout.skip), (0, ""))
    names = layout.names
    spare = fields(first.split("#")[0], layout.parted_by)[len(names) :] if first else []
    if any(spare):
        fault = f"found {len(names) + len(spare)} fields, expected {len(names)} as in the header"
        raise FormatError(path, f"line {number}: {fault}; {DECIMAL_COMMA}")
    padded = [*names, *spare]
    return [name if name in use else f"field {index}" for index, name in enumerate(padded)]


def _ragged(message: str) -> str:
    match = re.search(r"Expected (\d+) fields in line (\d+), saw (\d+)", message)
    if match is None:
        return f"cannot be split into columns: {message}"
    expected, line, saw = match.groups()
    return f"line {line}: found {saw} fields, expected {expected} as in the header; {DECIMAL_COMMA}"


def _first_fault(pieces: Iterator[pd.DataFrame], decimal: str) -> tuple[int, str, str]:
    """Find row, column and content of the first field that is not a number."""
    start, swapped = 0, str.maketrans(",.", ".,") if decimal == "," else {}
    for text in pieces:
        pointed = text.apply(lambda column: column.str.translate(swapped))
        wrong = pointed.apply(pd.to_numeric, errors="coerce").isna().to_numpy() & text.notna().to_numpy()
        if wrong.any():
            row, column = divmod(int(np.argmax(wrong)), wrong.shape[1])
            return start + row, str(text.columns[column]), str(text.iloc[row, column])
        start += len(text)
    raise AssertionError("no field fails where a column did")
