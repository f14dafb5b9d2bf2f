"""What the names of files state of the settings of a run: 6-n6000f1200ap3ae25.csv.

Who names files by their settings states them twice. Where name and row of the run table differ, one of them
is wrong, and nothing in the data need show it: coefficients absorb a feed that is off by a factor.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import PurePosixPath
from typing import Any

from metro.batch.findings import Finding
from metro.batch.tables import Table

SPEED, PER_TOOTH = "spindle_rpm", "feed_per_tooth_mm"
SETTINGS = {
    SPEED: r"(?:n|rpm|s)",
    PER_TOOTH: r"fz",
    "axial_depth_mm": r"ap",
    "radial_depth_mm": r"ae",
}
FEED = r"(?:vf|f)"  # mm/min, where it is not that per tooth
SLOWEST = 50.0  # rpm: n3 is the third record, and no speed
AGREE = 0.01  # relative, to which a name has the digits of a setting
FILES = ("dynamometer", "robot_log")  # columns whose files have the settings of their run in their names

_VALUE = r"[_-]?(\d+(?:[.p]\d+)?)"


def settings_in(name: str) -> dict[str, str]:
    """Return what a file's name states of its run, by column of the run table: n6000, fz0.1, ap3, ae25."""
    found = {column: _marked(mark, name) for column, mark in SETTINGS.items()}
    return {column: value for column, value in found.items() if value}


def stated_by_all(names: Sequence[str]) -> dict[str, list[str]]:
    """Return by column of the run table what every one of several names states."""
    stated = [settings_in(name) for name in names]
    return {
        column: [each[column] for each in stated]
        for column in SETTINGS
        if all(column in each for each in stated)
    }


def name_findings(table: Table, teeth: float | None) -> Iterator[Finding]:
    """Warn of rows whose files state other settings in their names.

    Letters with numbers may be anything (run n3, side s2). They are taken for settings where every name has
    them for two columns or more, and the whole run table agrees with the names in one of these.

    Parameters
    ----------
    table : the run table. teeth : of the tool, by which a feed in mm/min is one per tooth; None: not known.
    """
    for files in FILES:
        rows = [(position, row) for position, row in table.sound() if row[files]]
        stated = [_stated(str(row[files]), row, teeth) for _, row in rows]
        common = [column for column in SETTINGS if rows and all(column in each for each in stated)]
        wrong = {
            column: [i for i, (_, row) in enumerate(rows) if not _agree(stated[i][column], row[column])]
            for column in common
            if column != PER_TOOTH or _one_agrees(stated, rows)
        }
        if all(wrong.values()):
            continue
        for column, places in wrong.items():
            for i in places:
                position, row = rows[i]
                message = (
                    f'{row[column]:g} differs from "{row[files]}", whose name states '
                    f"{stated[i][column]:.4g}: correct the row, or exchange the files"
                )
                yield table.finding(position, column, message, "warning")


def _one_agrees(stated: Sequence[Mapping[str, float]], rows: Sequence[tuple[int, Mapping[str, Any]]]) -> bool:
    """Whether the feed in one name is that of one row, be it another one: f12 may be the twelfth file."""
    return any(_agree(each[PER_TOOTH], row[PER_TOOTH]) for each in stated for _, row in rows)


def _marked(mark: str, name: str) -> str:
    """Return the number that stands behind a mark in a name; empty: there is none."""
    match = re.search(rf"(?<![a-z]){mark}{_VALUE}", PurePosixPath(name).stem.lower())
    return match[1].replace("p", ".") if match else ""


def _stated(name: str, row: Mapping[str, Any], teeth: float | None) -> dict[str, float]:
    """Return what a name states as numbers; the feed per tooth by that per minute, where it is so stated."""
    stated = {column: float(value) for column, value in settings_in(name).items()}
    if stated.get(SPEED, SLOWEST) < SLOWEST:
        del stated[SPEED]
    feed, speed = _marked(FEED, name), stated.get(SPEED) or row[SPEED]
    if PER_TOOTH not in stated and feed and teeth and speed > 0.0:
        stated[PER_TOOTH] = float(feed) / (speed * teeth)
    return stated


def _agree(stated: float, declared: float) -> bool:
    """Whether a name agrees with a row, which may leave the setting open."""
    return not abs(stated - declared) > AGREE * declared
