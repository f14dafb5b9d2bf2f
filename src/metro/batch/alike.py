"""Findings that differ only in their row are reported as one: a folder that was not copied is one mistake."""

from __future__ import annotations

import re
from collections.abc import Iterable

FEW = 3  # so many are written out
ROW = re.compile(r"(?P<file>[^:\s]+): row (?P<row>\d+)(?: \([^)]*\))?: (?P<message>.+)")
QUOTED = re.compile(r'"[^"]*"')


def alike_as_one(lines: Iterable[str]) -> list[str]:
    """Return lines, those about many rows put together at the place of the first of them.

    Lines are alike that report the same fault in rows of one file, whatever they quote: the first quotation
    represents all.
    """
    groups: dict[tuple[str, ...], list[str]] = {}
    for place, line in enumerate(lines):
        match = ROW.fullmatch(line)
        key = (match["file"], QUOTED.sub('""', match["message"])) if match else (str(place),)
        groups.setdefault(key, []).append(line)
    return [line for group in groups.values() for line in (group if len(group) <= FEW else [_as_one(group)])]


def _as_one(group: list[str]) -> str:
    matches = [match for match in map(ROW.fullmatch, group) if match]
    message = matches[0]["message"]
    if len({match["message"] for match in matches}) > 1:
        message = QUOTED.sub(lambda quoted: f"{quoted[0]} (and {len(group) - 1} more)", message, count=1)
    return f"{matches[0]['file']}: rows {_ranges([int(match['row']) for match in matches])}: {message}"


def _ranges(rows: list[int]) -> str:
    """Write rows as people do: 2–12, 16."""
    spans: list[list[int]] = []
    for row in sorted(set(rows)):
        if spans and row == spans[-1][1] + 1:
            spans[-1][1] = row
        else:
            spans.append([row, row])
    return ", ".join(str(low) if low == high else f"{low}–{high}" for low, high in spans)
