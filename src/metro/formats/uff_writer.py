"""Frequency responses as a universal file: datasets 58 (text) or 58b (binary), double precision."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from metro.formats.uff import UNITS, Function

_SPECIFIC = {unit: code for code, unit in UNITS.items()}
_MARK = b"    -1\n"
_FORCE, _FREQUENCY = 13, 18


def universal_file(functions: Sequence[Function], *, binary: bool = True) -> bytes:
    """Return a universal file of functions of frequency in SI.

    Evenly spaced lines are written as first line and step, which hold six digits: exact again for the reader
    of this package, since the step of a measurement is a simple fraction. Other lines are written out: in
    full in a binary dataset, with six digits in a text one.
    """
    units = b"   164\n         1SI                          2\n" + _doubles(1.0, 1.0, 1.0) + _doubles(0.0)
    blocks = [_MARK + units + _MARK]
    blocks += [_MARK + _dataset(each, binary) + b"\n" + _MARK for each in functions]
    return b"".join(blocks)


def _doubles(*values: float) -> bytes:
    return "".join(f"{value:25.17E}" for value in values).replace("E", "D").encode() + b"\n"


def _dataset(function: Function, binary: bool) -> bytes:
    frequency, count = function.frequency, len(function.frequency)
    step = (frequency[-1] - frequency[0]) / max(count - 1, 1)
    even = np.allclose(np.diff(frequency), step, rtol=1e-6, atol=0.0)
    columns = [function.values.real, function.values.imag]
    table = np.stack(columns if even else [frequency, *columns], axis=1)
    body = table.astype("<f8").tobytes() if binary else _text(table, even=even).encode()
    size = f"{1:6d}{2:6d}{11:12d}{len(body):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    spacing = (1, frequency[0], step) if even else (0, 0.0, 0.0)
    none = f"{'NONE':<80}"
    lines = [
        f"{58:6d}b{size}" if binary else f"{58:6d}",
        *[none] * 5,
        f"{function.kind:5d}{0:10d}{1:5d}{0:10d}{_place(function.response)}{_place(function.reference)}",
        f"{6:10d}{count:10d}{spacing[0]:10d}{spacing[1]:13.5E}{spacing[2]:13.5E}{0.0:13.5E}",
        *(_axis(code, unit) for code, unit in _axes(function.unit)),
    ]
    return "\n".join(lines).encode() + b"\n" + body


def _axes(unit: str) -> list[tuple[int, str]]:
    return [(_FREQUENCY, "Hz"), (_SPECIFIC.get(unit, 0), unit or "NONE"), (_FORCE, "N"), (0, "NONE")]


def _axis(code: int, unit: str) -> str:
    return f"{code:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {unit:<20}"


def _place(point: str) -> str:
    return f" {'NONE':<10}{int(point[:-1]):10d}{'xyz'.index(point[-1]) + 1:4d}"


def _text(table: np.ndarray, *, even: bool) -> str:
    if not even:
        return "\n".join(f"{f:13.5E}{re:20.12E}{im:20.12E}" for f, re, im in table)
    flat = [f"{value:20.12E}" for value in table.ravel()]
    return "\n".join("".join(flat[i : i + 4]) for i in range(0, len(flat), 4))
