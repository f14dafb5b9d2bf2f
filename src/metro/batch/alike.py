"""Findings that differ only in their row are told as one: a folder that was not copied is one mistake."""

from __future__ import annotations

import re
from collections.abc import Iterable

FEW = 3  # so many are written out
ROW = re.compile(r"(?P<file>[^:\s]+): row (?P<row>\d+)(?: \([^)]*\))?: (?P<told>.+)")
QUOTED = re.compile(r'"[^"]*"')


def alike_as_one(lines: Iterable[str]) -> list[str]:
    """Return lines with those of many rows put together where the first of them stands.

    Lines are alike that say the same of rows of one file, whatever they quote: the first one's quotation
    stands for all.
    """
    groups: dict[tuple[str, ...], list[str]] = {}
    for place, line in enumerate(lines):
        found = ROW.fullmatch(line)
        key = (found["file"], QUOTED.sub('""', found["told"])) if found else (str(place),)
        groups.setdefault(key, []).append(line)
    return [line for group in groups.values() for line in (group if len(group) <= FEW else [_as_one(group)])]


def _as_one(group: list[str]) -> str:
    found = [match for match in map(ROW.fullmatch, group) if match]
    told = found[0]["told"]
    if len({match["told"] for match in found}) > 1:
        told = QUOTED.sub(lambda quoted: f"{quoted[0]} (and {len(group) - 1} more)", told, count=1)
    return f"{found[0]['file']}: rows {_ranges([int(match['row']) for match in found])}: {told}"


def _ranges(rows: list[int]) -> str:
    """Write rows as people do: 2–12, 16."""
    spans: list[list[int]] = []
    for row in sorted(set(rows)):
        if spans and row == spans[-1][1] + 1:
            spans[-1][1] = row
        else:
            spans.append([row, row])
    return ", ".join(str(low) if low == high else f"{low}–{high}" for low, high in spans)
