"""The data files that the tables name: inside the batch, not empty, and by their head what they should be."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from metro.batch.columns import OWN_TO_A_RUN
from metro.batch.findings import Finding, shown
from metro.batch.sources import Files, files_of, parted, source
from metro.batch.tables import Table, records

# Column of runs.csv → what kind of file it names, in the words of metro.formats.registry.
RUN_FILES = {
    "dynamometer": "force",
    "robot_log": "robot",
    "idle_log": "robot",
    "joint_log": "joints",
    "path": "path",
    "scan": "cloud",
    "profile": "profile",
    "slopes": "slopes",
    "poses": "poses",
    "targets": "targets",
}
LONGEST_NAME = 255  # bytes, of every file system
# What describes a cut in a row of runs.csv: settings as text, as numbers, and records of it.
OF_A_CUT = (
    *("operation", "direction", "spindle_rpm", "feed_per_tooth_mm", "axial_depth_mm", "radial_depth_mm"),
    *("orbit_rpm", "dynamometer", "scan", "profile", "slopes", "poses", "targets", "stable"),
)


def file_findings(folder: Path, runs: Table, impacts: Table, files: Files) -> Iterator[Finding]:
    """Check every file that ``runs.csv`` and ``impacts.csv`` name; the head of each is read once.

    ``files``: the mappings of ``batch.yaml``.
    """
    opened: dict[tuple[str, str], str | None] = {}
    for table, position, column, name, kind in _named(runs, impacts):
        if (name, kind) not in opened:
            file, _ = parted(folder, name)
            opened[name, kind] = _path_fault(folder, file) or _content_fault(folder, name, kind, files)
        fault = opened[name, kind]
        if fault:
            yield table.finding(position, column, f"{shown(name)} {fault}")
    yield from _shared(runs)


def in_the_air(row: Mapping[str, Any]) -> str:
    """Return the column whose log is of an arm that moved and cut nothing; "" where the row has none.

    It is ``joint_log``; or the only robot log of a row that describes no cut.
    """
    if row["joint_log"]:
        return "joint_log"
    logs = [name for name in ("robot_log", "idle_log") if row[name]]
    blank = all(row[name] == "" or row[name] != row[name] for name in OF_A_CUT)
    return logs[0] if blank and len(logs) == 1 else ""


def _named(runs: Table, impacts: Table) -> Iterator[tuple[Table, int, str, str, str]]:
    """Yield every file that is named: table, position of the row, column, path and kind."""
    rows = records(runs.frame)
    for column, kind in RUN_FILES.items():
        for position, row in enumerate(rows):
            if row[column]:
                free = in_the_air(row) == column
                yield runs, position, column, row[column], RUN_FILES["joint_log"] if free else kind
    for position, (name, kind) in enumerate(zip(impacts.frame["file"], impacts.frame["kind"], strict=True)):
        if name:
            yield impacts, position, "file", name, kind or "frf"


def _path_fault(folder: Path, name: str) -> str | None:
    """Describe the fault of a path that a table names; None where it is a file of the batch, not empty."""
    inside = "expected a path relative to the batch folder, inside it"
    too_long = max(len(part.encode()) for part in Path(name).parts) > LONGEST_NAME
    if "\\" in name or "\0" in name or too_long:
        why = "is written with backslashes" if "\\" in name else "is no name of a file"
        return f"{why}, {inside}, with /"
    if Path(name).is_absolute() or ".." in Path(name).parts:
        return f"leads outside the batch, {inside}"
    path = folder / name
    if not path.exists():
        return f"is not there, {inside}"
    if not path.resolve().is_relative_to(folder.resolve()):
        return f"is a link that leads outside the batch, {inside}"
    if not path.is_file():
        return "is a folder, expected a file"
    return None if path.stat().st_size else "is empty, expected data"


def _content_fault(folder: Path, name: str, kind: str, files: Files) -> str | None:
    """Describe what is wrong with the head of a data file, by the reader of its format."""
    from metro.formats import FormatError
    from metro.formats.registry import sniff

    for file in files_of(folder, name, files):
        fault = _path_fault(folder, file)
        if fault:
            return f"is read with {shown(file)}, which {fault}"
    try:
        sniff(source(folder, name, files), kind)
    except FormatError as error:
        return f"cannot be read: {error.message}"
    return None


def _shared(runs: Table) -> Iterator[Finding]:
    """Warn of a recording that two runs name: it belongs to one of them."""
    for position, (cut, idle) in enumerate(zip(runs.frame["robot_log"], runs.frame["idle_log"], strict=True)):
        if cut and cut == idle:
            message = f"{shown(idle)} is the log of the cut, too, expected that of a run without contact"
            yield runs.finding(position, "idle_log", message)
    for column in OWN_TO_A_RUN:
        first: dict[str, str] = {}
        for position, (run, name) in enumerate(zip(runs.frame["run"], runs.frame[column], strict=True)):
            if name and first.setdefault(name, run) != run:
                message = f"{shown(name)} is named by run {first[name]} too"
                yield runs.finding(position, column, message, "warning")
