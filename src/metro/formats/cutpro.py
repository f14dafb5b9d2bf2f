"""FRFs as CutPro reads them (.frf): frequency, real and imaginary part, the words for them behind the first.

The layout is known from a program that writes such files for CutPro, not from a description by its maker: the
first line has, behind its three numbers, ``Freq Hz Real m/N Imag`` and a word more.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw
from metro.formats.signalcalc import response_unit
from metro.formats.text import SPACES, Layout, number_pieces
from metro.formats.text_layout import head

SUFFIXES = (".frf",)
_NAMES = ("frequency_hz", "real", "imag")
_COUNT = len(_NAMES)


def read_cutpro(path: Path, _kind: Kind, rows: int | None) -> Raw:
    """Read an FRF; the unit of its response is in ``attrs["response_unit"]``.

    Raises
    ------
    FormatError
        Where the first line does not name its numbers so, or a line has no three numbers.
    """
    first = (head(path) or [""])[0].split()
    words = [word.lower() for word in first[_COUNT:]]
    if words[:3] != ["freq", "hz", "real"] or len(words) < 5 or words[4] != "imag":
        found = " ".join(first[:8])
        raise FormatError(
            path, f"line 1: found {found!r}, expected three numbers and Freq Hz Real m/N Imag, as of CutPro"
        )
    unit, factor = response_unit(path, 1, first[_COUNT + 3])
    try:
        numbers = [float(text) for text in first[:_COUNT]]
    except ValueError as error:
        raise FormatError(path, f"line 1: {error}") from error
    (rest,) = number_pieces(path, Layout(_NAMES, SPACES, 1), _NAMES, None, rows)
    frame = pd.concat([pd.DataFrame([numbers], columns=list(_NAMES)), rest.frame], ignore_index=True)[:rows]
    frame[["real", "imag"]] *= factor
    frame.attrs["response_unit"] = unit
    return Raw(frame, lambda row: f"line {row + 1}")
