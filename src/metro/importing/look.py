"""What unknown files hold: containers, columns with units and values, and copies among them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from metro.batch.rules import SELF_DESCRIBING
from metro.formats import FormatError
from metro.formats.contents import Contents
from metro.formats.kinds import KINDS
from metro.formats.registry import open_contents, read_frfs, sniff, stated_kinds
from metro.formats.text_layout import TextOptions
from metro.formats.uff_header import origin
from metro.formats.uff_modes import Mode, read_modes

BARS = "▁▂▃▄▅▆▇█"
WIDTH = 24  # characters of a sparkline
POINTS = (".xyz", ".pts", ".asc", ".stl")  # suffixes of lists of points
ALIKE = 32  # values: fewer may be the same by chance, as of a column of noughts


@dataclass(frozen=True)
class Column:
    """A column that was looked at: its name and unit in the file, its values, and what messages call it."""

    label: str
    name: str
    unit: str
    values: np.ndarray


@dataclass(frozen=True)
class Seen:
    """A file that was looked at.

    Attributes
    ----------
    path : the file.
    container : the title of its format.
    kind : what it is without a mapping, as a key of KINDS, or "modes"; "" where it needs a mapping.
    columns : what it has.
    step : between values in s, where the file describes it.
    modes : of a universal file that holds modes.
    origin : what such a file says of what wrote it, and of what is in it.
    placed : whether such a file says of each of its FRFs between which points it was measured.
    fault : why it cannot be read at all.
    """

    path: Path
    container: str = ""
    kind: str = ""
    columns: tuple[Column, ...] = ()
    step: float | None = None
    modes: tuple[Mode, ...] = ()
    origin: str = ""
    placed: bool = False
    fault: str = ""


def look(path: Path) -> Seen:
    """Look at a file; what keeps it from being read is in its ``fault``."""
    try:
        stated = stated_kinds(path)
        for kind in stated:
            if _is(path, kind):
                seen = _seen(path, kind, open_contents(path, kind, TextOptions()))
                if seen.container != "universal":
                    return seen
                return replace(seen, origin=origin(path), placed=_placed(path))
        if "frf" in stated and (modes := _modes(path)):
            return Seen(path, "universal", "modes", modes=modes, origin=origin(path))
        own = next((kind for kind in KINDS if kind != "cloud" and _is(path, kind)), "")
        seen = _seen(path, own, open_contents(path, own or "force", TextOptions()))
        named = any(column.name for column in seen.columns) or path.suffix.lower() in POINTS
        return replace(seen, kind="cloud") if not own and named and _is(path, "cloud") else seen
    except FormatError as error:
        return Seen(path, fault=error.message)


def _is(path: Path, kind: str) -> bool:
    try:
        sniff(path, kind)
    except FormatError:
        return False
    return True


def _placed(path: Path) -> bool:
    named = path.name.lower().endswith(SELF_DESCRIBING)  # by which impacts.csv may leave its points blank
    return named and all(frf.reference and frf.response for frf in read_frfs(path))


def _modes(path: Path) -> tuple[Mode, ...]:
    try:
        return tuple(read_modes(path))
    except FormatError:
        return ()


def _seen(path: Path, kind: str, contents: Contents) -> Seen:
    columns = []
    for own in contents.columns:
        try:
            values = np.concatenate(
                [raw.frame[own.label].to_numpy() for raw in contents.pieces([own.label], None)]
            )
        except FormatError:
            continue  # a column of text
        columns.append(Column(own.label, own.name, own.unit, values))
    steps = {own.clock.step for own in contents.columns if own.clock}
    return Seen(path, contents.container, kind, tuple(columns), steps.pop() if len(steps) == 1 else None)


def sparkline(values: np.ndarray) -> str:
    """Draw the course of values in a line of characters, each the largest size of its part."""
    finite = values[np.isfinite(values)]
    if not finite.size or np.ptp(finite) == 0.0:
        return BARS[0] * min(len(values), WIDTH)
    parts = [part for part in np.array_split(finite, min(WIDTH, finite.size)) if part.size]
    middle = np.median(finite)
    ends = np.array([part[np.argmax(np.abs(part - middle))] for part in parts])
    heights = (ends - finite.min()) / np.ptp(finite) * (len(BARS) - 1)
    return "".join(BARS[round(height)] for height in heights)


def copies(files: Sequence[Seen]) -> list[tuple[Seen, Column, Seen, Column]]:
    """Find measured columns that are the same bit for bit; not what only counts or is a clock."""
    first: dict[str, tuple[Seen, Column]] = {}
    found = []
    for seen in files:
        for column in seen.columns:
            if column.values.size < ALIKE or not _measured(column.values):
                continue
            key = hashlib.sha256(np.ascontiguousarray(column.values, np.float64).tobytes()).hexdigest()
            other = first.setdefault(key, (seen, column))
            if other[1] is not column:
                found.append((*other, seen, column))
    return found


def _measured(values: np.ndarray) -> bool:
    """Return whether values go up and down, as times, numbers of points and constants do not."""
    steps = np.diff(values)
    return bool((steps > 0).any() and (steps < 0).any())


def described(files: Iterable[Seen]) -> list[str]:
    """Say what was seen, line by line."""
    lines = []
    for seen in files:
        if seen.fault:
            lines.append(f"{seen.path.name}: {seen.fault}")
            continue
        if seen.modes:
            listed = ", ".join(f"{mode.damped:.4g}" for mode in seen.modes)
            lines.append(
                f"{seen.path.name}: {seen.container}, {len(seen.modes)} modes at {listed} Hz (damped)"
            )
            lines.append(f"  {seen.origin}")
            continue
        rows = max((column.values.size for column in seen.columns), default=0)
        what = f", {KINDS[seen.kind].title} as it is" if seen.kind else ""
        lines.append(f"{seen.path.name}: {seen.container}, {len(seen.columns)} columns, {rows} rows{what}")
        for column in seen.columns:
            unit = f" [{column.unit}]" if column.unit else ""
            low, high = np.nanmin(column.values, initial=np.inf), np.nanmax(column.values, initial=-np.inf)
            lines.append(
                f"  {sparkline(column.values):{WIDTH}}  {column.label}{unit}: {low:.5g} … {high:.5g}"
            )
    return lines
