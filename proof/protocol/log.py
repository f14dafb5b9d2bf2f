"""The log: one line of JSON for every suite that was judged, appended and never changed."""

from __future__ import annotations

import json
import os
from pathlib import Path

from metro.units import JSON


def append(log: Path, row: JSON) -> None:
    """Add a row at the end."""
    line = json.dumps(row, ensure_ascii=False, allow_nan=False)
    with log.open("a", encoding="utf-8") as stream:
        stream.write(line + "\n")
        stream.flush()
        os.fsync(stream.fileno())


def rows(log: Path) -> list[JSON]:
    """Return all rows, the oldest first."""
    if not log.is_file():
        return []
    return [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]


def newest(log: Path) -> dict[str, dict[str, JSON]]:
    """Return the newest row of each program, by observable and program."""
    found: dict[str, dict[str, JSON]] = {}
    for row in rows(log):
        found.setdefault(row["observable"], {})[row["program"]] = row
    return found
