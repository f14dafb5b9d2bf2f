"""Text exports of Kistler DynoWare: a preamble, a line of channel names, a line of units, and the samples."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw, columns_to_read
from metro.formats.text import Layout, fields, lines, numbers, separator
from metro.units import MS

_CHANNELS = {"time": "t_s", "fx": "fx_n", "fy": "fy_n", "fz": "fz_n"}
_TIME_UNITS = {"s": 1.0, "ms": MS}
_FORCE_UNITS = {"N": 1.0, "kN": 1e3}
_PREAMBLE_LINES = 200


def read_dynoware(path: Path, kind: Kind, rows: int | None) -> Raw:
    """Read the channels Time, Fx, Fy and Fz in s and N; other channels are ignored.

    Raises
    ------
    FormatError
        Where the line of channels is missing, a unit is not one of s, ms, N, kN, or a sample is not a number.
    """
    number, header = _channel_line(path)
    parted_by = separator(path, number, header)
    names = [_CHANNELS.get(field.lower(), field) for field in fields(header, parted_by)]
    use = columns_to_read(path, kind, names)
    units_number, units_line = next(lines(path, number), (number + 1, ""))
    units = dict(zip(names, fields(units_line, parted_by), strict=False))
    raw = numbers(path, Layout(tuple(names), parted_by, units_number), use, rows)
    factors = {name: _factor(path, units_number, name, units.get(name, "")) for name in use}
    return Raw(raw.frame.mul(pd.Series(factors)), raw.place)


def _channel_line(path: Path) -> tuple[int, str]:
    for number, text in lines(path):
        if text[:4].lower() == "time" and len(text) > 5 and text[4] in ",\t;" and "fx" in text.lower():
            return number, text
        if number > _PREAMBLE_LINES:
            break
    expected = f"expected one within the first {_PREAMBLE_LINES} lines of a DynoWare export"
    raise FormatError(path, f"found no line of channels (Time, Fx, Fy, Fz), {expected}")


def _factor(path: Path, number: int, name: str, unit: str) -> float:
    known = _TIME_UNITS if name == "t_s" else _FORCE_UNITS
    if unit not in known:
        expected = " or ".join(known)
        raise FormatError(path, f"line {number}, column {name}: found the unit {unit!r}, expected {expected}")
    return known[unit]
