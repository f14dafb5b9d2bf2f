"""Modes in a universal file: datasets 55 of normal modes and of complex eigenvalues."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from metro.formats.errors import FormatError
from metro.formats.uff import datasets

_NORMAL, _COMPLEX = 2, 3  # analysis type
_ID_LINES = 5


@dataclass(frozen=True)
class Mode:
    """A mode as a file has it.

    Attributes
    ----------
    number : as the file counts.
    frequency : undamped, Hz.
    damped : Hz.
    damping : ratio.
    """

    number: int
    frequency: float
    damped: float
    damping: float


def read_modes(path: Path) -> list[Mode]:
    """Read frequency and damping of every dataset 55 that is a mode; shapes are passed over.

    Raises
    ------
    FormatError
        With the number of the dataset that is not what such datasets hold.
    """
    data = path.read_bytes()
    modes = []
    for number, (name, start, end) in enumerate(datasets(path, data), start=1):
        if name == "55":
            try:
                mode = _mode(data[start:end].decode("latin-1").splitlines())
            except (ValueError, IndexError) as error:
                raise FormatError(
                    path, f"dataset {number} (55): is not what it should hold: {error}"
                ) from error
            modes += [mode] if mode else []
    return modes


def _mode(lines: list[str]) -> Mode | None:
    """Read a dataset: its number, five lines of text, and records 6 to 8; None where it is no mode."""
    form = [int(field) for field in lines[1 + _ID_LINES].split()]
    numbers = [int(field) for field in lines[2 + _ID_LINES].split()]
    values = [float(lines[3 + _ID_LINES][at : at + 13].replace("D", "E")) for at in (0, 13)]
    if form[1] == _NORMAL:
        damping = float(lines[3 + _ID_LINES][26:39])
        return Mode(numbers[3], values[0], values[0] * math.sqrt(max(1.0 - damping**2, 0.0)), damping)
    if form[1] == _COMPLEX:
        real, imaginary = values
        size = math.hypot(real, imaginary)
        return Mode(numbers[3], size / (2 * math.pi), abs(imaginary) / (2 * math.pi), -real / size)
    return None
