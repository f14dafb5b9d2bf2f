"""Readings of a level or an autocollimator whose columns name both feet and the slope in their own words."""

from __future__ import annotations

import re

from metro.formats.channels import parted
from metro.importing.look import Seen
from metro.importing.propose import Proposal

_NAMES = {
    **{f"{axis}{k}_mm": rf"{axis}_?{k}" for k in (1, 2) for axis in "xy"},
    "slope_urad": r"slope|tilt|angle|inclination|reading|neigung|ablesung",
    "line": r"line|linie",
}


def slope_readings(seen: Seen) -> Proposal | None:
    """Propose how readings of slopes are read; None where a file shows none."""
    columns: dict[str, str | int | tuple[str, int]] = {}
    stated: dict[str, str] = {}
    for column in seen.columns:
        bare, unit = parted(column.name)
        for name, pattern in _NAMES.items():
            if name not in columns and re.fullmatch(pattern, bare.strip().replace(" ", "_"), re.IGNORECASE):
                columns[name] = column.name
                given = "1" if name == "line" else column.unit or unit
                stated |= {name: given} if given else {}
    if any(name not in columns for name in _NAMES if name != "line"):
        return None
    why = {name: f"the name {source}" for name, source in columns.items()}
    return Proposal("slopes", ((seen.path.name, ""),), seen.path.name, columns, why, stated=stated)
