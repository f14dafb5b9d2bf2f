"""What a universal file says of itself: its header (dataset 151), and which datasets it has."""

from __future__ import annotations

from pathlib import Path

from metro.formats.uff import counted, datasets

_RECORDS = 7
_BLANK = {"", "none"}


def origin(path: Path) -> str:
    """Say what wrote a universal file, of which model, when, and which datasets are in it.

    Raises
    ------
    FormatError
        Where it is not made of datasets.
    """
    data = path.read_bytes()
    found = list(datasets(path, data))
    said = []
    for name, start, end in found:
        if name == "151":
            lines = data[start:end].decode("latin-1").splitlines()[1 : 1 + _RECORDS]
            said = _header([line.strip() for line in lines] + [""] * _RECORDS)
            break
    _, listed = counted(found)
    return "; ".join([*said, f"datasets {listed}"])


def _header(lines: list[str]) -> list[str]:
    """Name what the records of a header state: model, description, program and date, writer and date."""
    model, about, program, made, _, writer, written = lines[:_RECORDS]
    stated = (
        ("model", model),
        ("description", about),
        ("from", program),
        ("of", made),
        ("written by", writer),
        ("on", written),
    )
    return [f"{what} {' '.join(text.split())}" for what, text in stated if text.lower() not in _BLANK]
