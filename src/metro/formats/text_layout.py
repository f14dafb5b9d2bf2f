"""How a text file of any program holds its numbers: what separates them, where they start, their names."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from metro.formats.channels import parted
from metro.formats.errors import FormatError
from metro.formats.measures import MeasureError, measure, stripped
from metro.formats.text import SPACES, fields, is_number, unpacked

DELIMITERS = {",": ",", ";": ";", "tab": "\t", "space": SPACES}
_LINES = 1000  # of a file, in which its numbers must start
_ALIKE = 3  # lines of as many fields that a table begins with


@dataclass(frozen=True)
class TextOptions:
    """What is stated of a text file; None where it is to be found from the file.

    Attributes
    ----------
    start_row : line of the file, counted from 1, with the first numbers.
    delimiter : key of :data:`DELIMITERS`.
    decimal : "." or ",".
    """

    start_row: int | None = None
    delimiter: str | None = None
    decimal: str | None = None


@dataclass(frozen=True)
class TextTable:
    """A table of numbers in a text file.

    Attributes
    ----------
    names, units : of each column; "" where the file states none.
    parted_by : what separates the columns.
    decimal : the decimal sign.
    skip : lines before the first row.
    preamble : these lines.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    parted_by: str
    decimal: str
    skip: int
    preamble: tuple[str, ...]


def head(path: Path) -> list[str]:
    """Return the first lines of a text file; UTF-8, or the code page of Windows in Western Europe."""
    with unpacked(path) as stream:
        data = b"".join(islice(stream, _LINES))
    for code in ("utf-8-sig", "cp1252"):
        try:
            return data.decode(code).splitlines()
        except UnicodeDecodeError:
            continue
    return data.decode("latin-1").splitlines()


def find_table(path: Path, options: TextOptions) -> TextTable:
    """Find the table of numbers in a text file.

    Raises
    ------
    FormatError
        Where there is none.
    """
    text = head(path)
    found = [
        (start, parted_by, decimal, count)
        for parted_by, decimal in _ways(options)
        for start, count in [_start(text, parted_by, decimal, options.start_row)]
        if count
    ]
    if not found:
        where = f"from line {options.start_row}" if options.start_row else f"in the first {_LINES} lines"
        message = f"found no {_ALIKE} lines of numbers in columns {where}"
        raise FormatError(
            path, f"{message}: state start_row, delimiter or decimal in a mapping of batch.yaml"
        )
    # Of several ways to read the lines the one of most columns is right: others take a separator for text.
    start, parted_by, decimal, count = max(found, key=lambda one: one[3])
    row = fields(text[start].strip("\r\n "), parted_by)
    names, units = _header(text[:start], parted_by, count, len(row))
    return TextTable(names, units, parted_by, decimal, start, tuple(text[:start]))


def _ways(options: TextOptions) -> Iterator[tuple[str, str]]:
    delimiters = [DELIMITERS[options.delimiter]] if options.delimiter else ["\t", ";", ",", SPACES]
    for parted_by in delimiters:
        for decimal in [options.decimal] if options.decimal else [".", ","]:
            if parted_by != decimal:
                yield parted_by, decimal


def _start(text: list[str], parted_by: str, decimal: str, stated: int | None) -> tuple[int, int]:
    """Return how many lines come before the numbers, and how many columns these have; 0 where none are."""
    begin = 0 if stated is None else stated - 1
    patterns = [_numeric(line, parted_by, decimal) for line in text[begin:]]
    rows = [(at, pattern) for at, pattern in enumerate(patterns) if pattern is not None]
    for first in range(len(rows)):
        some = [pattern for _, pattern in rows[first : first + _ALIKE]]
        if len({len(pattern) for pattern in some}) == 1 and any(map(all, zip(*some, strict=True))):
            last = rows[first + len(some) - 1][0]
            if last - rows[first][0] == len(some) - 1 and (
                len(some) == _ALIKE or last == len(text) - begin - 1
            ):
                return begin + rows[first][0], len(some[0])
        if stated is not None:
            break
    return 0, 0


def _numeric(line: str, parted_by: str, decimal: str) -> list[bool] | None:
    """Return which fields of a line are numbers; None where it is no row of a table."""
    parts = fields(line.strip("\r\n "), parted_by)
    if parts and not parts[-1]:
        parts = parts[:-1]  # a separator at the end of the line
    numbers = [is_number(each.replace(decimal, ".") if decimal == "," else each) for each in parts]
    if decimal == "," and any("." in each for each, number in zip(parts, numbers, strict=True) if number):
        return None
    blank = sum(not each for each in parts)
    return numbers if sum(numbers) and 2 * (sum(numbers) + blank) > len(parts) else None


def _header(
    preamble: list[str], parted_by: str, count: int, most: int
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Take names and units from the last lines before the numbers that have as many fields as these.

    The numbers have ``count`` columns, and up to ``most`` with those at their end that are blank (comments).

    Other programs separate names of columns by tabs where they align numbers by spaces, and the other way.
    """
    lines = [line.strip("\r\n").lstrip("#% ") for line in preamble if line.strip("\r\n\t ,;")]
    names: list[str] = []
    units = [""] * count
    for line in reversed(lines[-4:]):
        parts = next(
            (found for way in (parted_by, "\t") if (found := _exactly(line, way, count, most))), None
        )
        if parts is None:
            continue
        if not any(units) and _are_units(parts):
            units = [stripped(each) for each in parts]
            continue
        if not all(map(is_number, parts)):
            names = parts
            break
    own = [parted(each) for each in names] or [("", "")] * count
    given = [unit or stated for (_, unit), stated in zip(own, units, strict=True)]
    return tuple(names or [""] * count), tuple(given)


def _exactly(line: str, parted_by: str, count: int, most: int) -> list[str] | None:
    parts = fields(line, parted_by)
    while len(parts) > count and not parts[-1]:
        parts = parts[:-1]
    return parts[:count] if len(parts) in (count, most) else None


def _are_units(parts: list[str]) -> bool:
    stated = [each for each in parts if each]
    return bool(stated) and all(map(_is_unit, stated))


def _is_unit(text: str) -> bool:
    try:
        measure(text)
    except MeasureError:
        return False
    return True
