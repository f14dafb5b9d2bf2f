"""Recordings whose values are the same bits as those of another run, whatever file they are in."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.findings import Finding
from metro.batch.processed import Tables
from metro.joint_columns import TORQUES
from metro.units import Array

LEAST_VALUES = 16  # different ones: fewer can be alike by chance, or be a coarse converter's
# Canonical table → column of runs.csv that names its files, and measured columns. Two runs may follow one
# programmed path, and an arm its set-points; noise never repeats.
MEASURED = {
    "force": ("dynamometer", ("fx_n", "fy_n", "fz_n")),
    "robot": ("robot_log", TORQUES),
    "scan": ("scan", ("z_mm",)),
    "profile": ("profile", ("z_mm",)),
    "slopes": ("slopes", ("slope_urad",)),
    "poses": ("poses", ("x_mm", "y_mm", "z_mm")),
}
HIT = ("test", "position", "reference", "response", "replicate")


def copies(batch: Batch, read: Tables) -> Iterator[Finding]:
    """Yield an error for each channel of a run, or of a hit, that is another one's."""
    for table, (column, _) in MEASURED.items():
        first: dict[str, tuple[str, str]] = {}
        for run in batch.with_files(column):
            rows = _rows(read, table, run)
            for name, values in rows:
                key = digest(values)
                other = first.setdefault(key, (run, name)) if key else (run, name)
                if other[0] != run:
                    yield _finding(batch, run, column, name, other)
                    break
    yield from _hits(read("hit"))


def _rows(read: Tables, table: str, run: str) -> Iterator[tuple[str, Array]]:
    """Yield the measured channels of a run; of the robot, those of the cut."""
    _, channels = MEASURED[table]
    pieces = [piece for piece in read.pieces(table, run) if len(piece)]
    if not pieces:
        return
    rows = pd.concat(pieces, ignore_index=True)
    if "log" in rows:
        rows = rows[rows["log"] == "cut"]
    for name in channels:
        if rows[name].notna().any():
            yield name, rows[name].to_numpy(float)


def _finding(batch: Batch, run: str, column: str, name: str, other: tuple[str, str]) -> Finding:
    file, theirs = str(batch.runs[column][run]), str(batch.runs[column][other[0]])
    message = (
        f"column {name}: has the same values as {other[1]} of {theirs} (run {other[0]}), expected a "
        f"recording of its own; name in runs.csv the file that was recorded in run {run}, or leave it blank"
    )
    return Finding("error", file, message, run=run)


def _hits(table: pd.DataFrame) -> Iterator[Finding]:
    """Yield an error for each response of a hammer record that is that of another one."""
    first: dict[str, Sequence[object]] = {}
    for name, rows in table.groupby(list(HIT), sort=False):
        key = digest(rows["response_si"].to_numpy(float))
        other = first.setdefault(key, name) if key else name
        if other != name:
            here, there = (", ".join(map(str, each)) for each in (name, other))
            message = (
                f"the response of {here} has the same values as that of {there}, expected a recording "
                "of its own; correct the file of one of the two rows"
            )
            yield Finding("error", "impacts.csv", message)


def digest(values: Array) -> str:
    """Hash of values; "" where they are too few to differ."""
    values = values[np.isfinite(values)]
    if len(np.unique(values[: 64 * LEAST_VALUES])) < LEAST_VALUES:
        return ""
    return hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()
