"""What the readers of point clouds share: coordinates in millimetres, float64."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw, columns_to_read

_COORDINATE = re.compile(r"([xyz])(?:[\s_(\[]*(\w+)[)\]]?)?", re.IGNORECASE)


def coordinate(path: Path, name: str) -> str:
    """Give the contract's name of a coordinate (``X``, ``x [mm]`` → ``x_mm``); keep other names."""
    match = _COORDINATE.fullmatch(name.strip())
    if match is None:
        return name
    if match[2] in ("m", "um", "in", "cm"):
        raise FormatError(path, f"column {name}: found coordinates in {match[2]}, expected mm")
    return f"{match[1].lower()}_mm" if match[2] in (None, "mm") else name


def points(
    path: Path, kind: Kind, names: Sequence[str], read: Callable[[list[str]], Raw | Mapping[str, np.ndarray]]
) -> Raw:
    """Read the coordinates among the columns ``names`` of a file.

    ``read`` is given the file's own names of x, y, z, and returns their columns.
    """
    contract_names = [coordinate(path, name) for name in names]
    use = columns_to_read(path, kind, contract_names)
    own = dict(zip(contract_names, names, strict=True))
    found = read([own[name] for name in use])
    columns = found.frame if isinstance(found, Raw) else found
    frame = pd.DataFrame({name: np.asarray(columns[own[name]], np.float64) for name in use}, copy=False)
    return Raw(frame, found.place if isinstance(found, Raw) else lambda row: f"point {row + 1}")
