"""Profiles of software gauges (type F2) as XML: heights one below the other, with their unit and spacing."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd

from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw
from metro.formats.limits import LARGEST_XML, check_unpacked
from metro.formats.measures import UNITS

STARTS = (b"<?xml",)
HOLDS = b"<DATA>"


def read_softgauge(path: Path, _kind: Kind, rows: int | None) -> Raw:
    """Read the heights and spacing, which are in the file's one unit, as ``x_mm`` from 0 and ``z_mm``.

    Raises
    ------
    FormatError
        Where an element is missing, the unit is unknown, or there are not as many heights as the file says.
    """
    check_unpacked(path, path.stat().st_size, "the XML of a profile", LARGEST_XML)
    text = path.read_text(encoding="utf-8", errors="replace")
    unit = _element(path, text, "UNITS").strip()
    if unit not in UNITS["length"]:
        raise FormatError(path, f"UNITS: found {unit!r}, expected one of {', '.join(UNITS['length'])}")
    to_mm = UNITS["length"][unit]
    try:
        count = int(_element(path, text, "NUMPOINTS"))
        spacing = float(_element(path, text, "SPACING"))
        heights = np.array(_element(path, text, "DATA_POINT_VALUES").split(), dtype=np.float64)
    except ValueError as error:
        message = f"{error}, expected a number in NUMPOINTS, SPACING, DATA_POINT_VALUES"
        raise FormatError(path, message) from error
    if len(heights) != count:
        raise FormatError(path, f"found {len(heights)} heights, expected {count} as NUMPOINTS says")
    table = pd.DataFrame({"x_mm": np.arange(count) * spacing * to_mm, "z_mm": heights * to_mm})
    return Raw(table[:rows], lambda row: f"point {row + 1}")


def _element(path: Path, text: str, name: str) -> str:
    """Return the text of an element that holds nothing else; the first, which is the measured profile."""
    match = re.search(rf"<{name}>([^<]*)</{name}>", text)
    if match is None:
        raise FormatError(path, f"found no element {name}, expected one of a software gauge")
    return match[1]
