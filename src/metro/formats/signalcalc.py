"""FRFs of Data Physics SignalCalc as text: a preamble, then lines of frequency, real and imaginary part."""

from __future__ import annotations

import re
from pathlib import Path

import pandas as pd

from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw
from metro.formats.measures import RESPONSES, MeasureError, measure, per_force
from metro.formats.text import SPACES, Layout, number_pieces
from metro.formats.text_layout import head

STARTS = (b"Units:",)
HOLDS = b"Ref Chan:Resp Chan"
_NAMES = ("frequency_hz", "real", "imag")


def read_signalcalc(path: Path, _kind: Kind, rows: int | None) -> Raw:
    """Read an FRF; the unit of its response is in ``attrs["response_unit"]``.

    Raises
    ------
    FormatError
        Where the columns or their units are not those of an FRF of a response per force.
    """
    text = [line.strip() for line in head(path)]
    names = next(
        (at for at, line in enumerate(text) if line.split() == ["Frequency", "Real", "Imaginary"]), None
    )
    if names is None:
        raise FormatError(path, "found no line Frequency Real Imaginary, expected an FRF exported so")
    at = next((k for k in range(names, len(text)) if text[k].startswith("Hz")), None)
    if at is None:
        raise FormatError(path, "found no line of units that begins with Hz")
    unit, factor = response_unit(path, at + 1, re.sub(r"^Hz\s*", "", text[at]))
    (raw,) = number_pieces(path, Layout(_NAMES, SPACES, at + 1), _NAMES, None, rows)
    frame: pd.DataFrame = raw.frame * [1.0, factor, factor]
    frame.attrs["response_unit"] = unit
    return Raw(frame, raw.place)


def response_unit(path: Path, number: int, text: str) -> tuple[str, float]:
    """Return the contract's unit of the response and the factor to it; ``(m/s²)(N)`` means the ratio."""
    try:
        read = per_force(text)
    except MeasureError as error:
        raise FormatError(path, f"line {number}: {error}") from error
    if read.unit == "g":
        return "g", read.factor / measure("g").factor
    unit, to_unit = RESPONSES[read.quantity]
    return unit, read.factor * to_unit
