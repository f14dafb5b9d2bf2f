"""Text exports of Kistler DynoWare: a preamble, a line of channel names, a line of units, and the samples.

The preamble may have any number of lines up to 200; columns are parted by tabs, semicolons or commas; between
tabs and semicolons numbers may have decimal commas; units are in a line of their own or behind the names.
Times count from the trigger: those before it are negative.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import pandas as pd

from metro.formats.channels import column_of, factor
from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw, columns_to_read
from metro.formats.text import Layout, fields, lines, number_pieces

_PREAMBLE_LINES = 200
_SAMPLES = 8
_NAME_AND_UNIT = re.compile(r"(.*?)\s*[\[(](.*)[\])]")


def dynoware_pieces(path: Path, kind: Kind, rows: int | None) -> Iterator[Raw]:
    """Read the channels Time, Fx, Fy and Fz in s or ms and N or kN, in pieces; other channels are ignored.

    Raises
    ------
    FormatError
        Where the line of channels is missing, a unit is not one of s, ms, N, kN, or a sample is not a number.
    """
    number, header = _channel_line(path)
    parted_by = _separator(header)
    own, units = _named(fields(header, parted_by))
    if not any(units):
        number, text = next(lines(path, number), (number + 1, ""))
        units = fields(text, parted_by)
    names = [column_of(kind, name) for name in own]
    use = columns_to_read(path, kind, names)
    layout = Layout(tuple(names), parted_by, number, _decimal(path, number, parted_by))
    factors = {}
    for name in use:
        at = names.index(name)
        unit = units[at] if at < len(units) else ""
        factors[name] = factor(path, name, f"line {number}", own[at], unit)
    for raw in number_pieces(path, layout, use, rows):
        yield Raw(raw.frame.mul(pd.Series(factors)), raw.place)


def _channel_line(path: Path) -> tuple[int, str]:
    for number, text in lines(path):
        names, _ = _named(fields(text, _separator(text)))
        if {"time", "fx"} <= {name.lower() for name in names}:
            return number, text
        if number > _PREAMBLE_LINES:
            break
    expected = f"expected one within the first {_PREAMBLE_LINES} lines of a DynoWare export"
    message = f"found no line of channels (Time, Fx, Fy, Fz), {expected}"
    raise FormatError(path, f"{message}: export again with the column of time and these names")


def _separator(text: str) -> str:
    return next((mark for mark in "\t;" if mark in text), ",")


def _decimal(path: Path, number: int, parted_by: str) -> str:
    """Return the decimal sign of the first samples: a comma, if it parts no columns and there is no point."""
    samples = "".join(text for _, text in islice(lines(path, number), _SAMPLES))
    return "," if parted_by != "," and "," in samples and "." not in samples else "."


def _named(labels: list[str]) -> tuple[list[str], list[str]]:
    """Part names from units that follow them."""
    parts = [_NAME_AND_UNIT.fullmatch(each) for each in labels]
    names = [part[1] if part else each for part, each in zip(parts, labels, strict=True)]
    return names, [part[2] if part else "" for part in parts]
