"""The run table: what its rows must fulfil, and what is filled in where they are blank."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import pandas as pd

from metro.batch.files import RUN_FILES, in_the_air
from metro.batch.findings import Finding
from metro.batch.tables import Table, records
from metro.units import JSON, MM

HOLE = "hole_diameter_mm"  # key of batch.yaml
# What makes the condition of a run, and how it is written in the name of one that the table leaves blank.
SETTINGS = {
    "operation": "",
    "spindle_rpm": "n",
    "feed_per_tooth_mm": "f",
    "axial_depth_mm": "ap",
    "radial_depth_mm": "ae",
    "direction": "",
    "feed_direction_deg": "dir",
    "orbit_rpm": "orbit",
    "wrist": "",
    "location": "",
    "orientation": "",
    "pose": "",
}


def run_findings(table: Table, manifest: JSON, hole_unread: bool = False) -> Iterator[Finding]:
    """Check the rows against each other, and against the tool and the hole of ``batch.yaml``.

    Parameters
    ----------
    table : the run table.
    manifest : what of ``batch.yaml`` is sound.
    hole_unread : whether the hole may be stated there and could not be read: its lack is no fault then.
    """
    diameter = _length((manifest.get("tool") or {}).get("diameter_mm"))
    hole = _length(manifest.get(HOLE))
    yield from _twice(table, "run", table.frame["run"])
    yield from _twice(table, "order", table.frame["order"].fillna(_places(table.frame)))
    for position, row in table.sound():
        faults = [
            *_sizes(row, diameter),
            *_immersion(row, diameter),
            *(_helical(row, diameter, hole, hole_unread) if row["operation"] == "helical" else []),
        ]
        yield from (table.finding(position, column, message) for column, message in faults)
        for column, message in _out_of_reach(row, manifest.get("tool") or {}):
            yield table.finding(position, column, message, "warning")


def filled(frame: pd.DataFrame, manifest: JSON) -> pd.DataFrame:
    """Return the run table in the order of cutting, with blanks filled in as the contract has it.

    ``order`` is the row's place; a slot's ``direction`` and ``radial_depth_mm`` are known;
    ``feed_direction_deg`` is 0; runs of the same nominal settings are of one ``condition``, and are its
    replicates.
    ``cut_before_m`` is added: metres cut by all rows of lower order. The robot log of a row that describes no
    cut is its ``joint_log``.
    """
    runs = _with_joint_logs(frame)
    runs["order"] = runs["order"].fillna(_places(runs)).astype(int)
    runs = runs.sort_values("order", kind="stable").reset_index(drop=True)
    slots = runs["operation"].isin(["slot", "helical"])
    runs["direction"] = runs["direction"].mask(slots & (runs["direction"] == ""), "slot")
    diameter = (manifest.get("tool") or {}).get("diameter_mm")
    if diameter is not None:
        full = (runs["operation"] == "slot") & runs["radial_depth_mm"].isna()
        runs["radial_depth_mm"] = runs["radial_depth_mm"].mask(full, float(diameter))
    runs["feed_direction_deg"] = runs["feed_direction_deg"].fillna(0.0)
    names = pd.Series([settings_name(row) for row in records(runs[[*SETTINGS]])], runs.index, dtype=str)
    runs["condition"] = runs["condition"].mask(runs["condition"] == "", names)
    place = runs.groupby("condition").cumcount() + 1
    runs["replicate"] = runs["replicate"].fillna(place).astype(int)
    cut = runs["cut_length_mm"].fillna(0.0)
    runs["cut_before_m"] = (cut.cumsum() - cut) * MM
    return runs


def _with_joint_logs(frame: pd.DataFrame) -> pd.DataFrame:
    """Return a copy of the run table in which logs of an arm that cut nothing are joint logs, too."""
    runs = frame.copy()
    for at, row in zip(runs.index, records(frame), strict=True):
        column = in_the_air(row)
        if column not in ("", "joint_log"):
            runs.loc[at, "joint_log"] = row[column]
    return runs


def settings_name(row: Mapping[Any, Any]) -> str:
    """Return a name for a run's nominal settings that depends on nothing but them."""
    parts = []
    for column, mark in SETTINGS.items():
        value = row[column]
        if isinstance(value, str):
            parts += [value] if value else []
        elif pd.notna(value) and not (column == "feed_direction_deg" and value == 0):
            parts.append(f"{mark}{value:g}")
    return " ".join(parts) or "unstated"


def recorded(runs: pd.DataFrame) -> pd.Series:
    """Return which rows were recorded: those with a role, a file other than the path, or a judgement."""
    return (runs[["role", "stable", *(name for name in RUN_FILES if name != "path")]] != "").any(axis=1)


def design_findings(runs: pd.DataFrame, file: str) -> Iterator[Finding]:
    """Report where the design of the session limits what can be learned from it; ``runs`` as filled in."""
    yield from _conditions(runs, file)
    repeats = runs["condition"].map(runs["condition"].value_counts()) > 1
    changes = (runs["condition"] != runs["condition"].shift()).sum()
    if repeats.any() and changes == runs["condition"].nunique() > 1:
        message = (
            "the repeats of each condition were cut back to back: a change along the session (wear, "
            "warm-up) cannot be separated from the conditions; spread the repeats over the session"
        )
        yield Finding("note", file, message, column="order")
    unknown = int(runs["cut_length_mm"].isna().sum())
    if 0 < unknown < len(runs):
        message = f"is blank in {unknown} of {len(runs)} rows: they count nothing towards the length cut"
        yield Finding("note", file, message, column="cut_length_mm")
    mixed = runs[runs["role"] != ""].groupby("condition")["role"].nunique()
    for name in mixed.index[mixed > 1]:
        message = f'condition "{name}" has runs of both roles: it is not held out as a whole'
        yield Finding("warning", file, message, column="role")


def _conditions(runs: pd.DataFrame, file: str) -> Iterator[Finding]:
    """Warn where conditions are not what they are said to be: the same settings, and no other ones."""
    settings = pd.Series([settings_name(row) for row in records(runs[[*SETTINGS]])], runs.index, dtype=str)
    for name, group in settings.groupby(runs["condition"]):
        if group.nunique() > 1:
            message = f'condition "{name!s}" has runs of different settings: {"; ".join(sorted(set(group)))}'
            yield Finding("warning", file, message, column="condition")
    for name, group in runs["condition"].groupby(settings):
        if group.nunique() > 1:
            message = f"conditions {', '.join(sorted(set(group)))} have the same settings: {name!s}"
            yield Finding("warning", file, message, column="condition")


def _places(frame: pd.DataFrame) -> pd.Series:
    """Return each row's place in the file, from 1."""
    return pd.Series(range(1, len(frame) + 1), frame.index, dtype=float)


def _length(value: Any) -> float | None:
    """Return a length of the manifest where it is one."""
    return float(value) if isinstance(value, int | float) else None


def _twice(table: Table, column: str, values: pd.Series) -> Iterator[Finding]:
    """Report every value that an earlier row has already."""
    first: dict[Any, int] = {}
    for position, value in enumerate(values):
        other = first.setdefault(value, position)
        if other != position and position not in table.faulty:
            shown = f"{value:g}" if isinstance(value, float) else f'"{value}"'
            yield table.finding(
                position, column, f"{shown} is also in row {table.rows[other]}, expected each once"
            )


def _sizes(row: Mapping[str, Any], diameter: float | None) -> Iterator[tuple[str, str]]:
    """Check lengths by what a mill can do: a wrong unit is a factor of a thousand.

    A cut is not much thinner than the rounding of its edge, some µm; of a tool of less than 1 mm the least
    depth and the least feed are smaller in proportion to its diameter.
    """
    small = 1.0 if diameter is None else min(diameter, 1.0)
    limits = {
        "feed_per_tooth_mm": (1e-4 * small, 5.0 if diameter is None else diameter / 2),
        "axial_depth_mm": (5e-3 * small, 500.0 if diameter is None else 20 * diameter),
        "radial_depth_mm": (1e-2 if diameter is None else 1e-3 * diameter, math.inf),
        "cut_length_mm": (0.1, 1e7),
    }
    for column, (low, high) in limits.items():
        value = row[column]
        if 0 < value <= low:
            yield column, f"found {value:g}, expected more than {low:g} mm: it seems to be in metres"
        if value > high:
            yield column, f"found {value:g}, expected at most {high:g} mm: it seems to be in another unit"


def _immersion(row: Mapping[str, Any], diameter: float | None) -> Iterator[tuple[str, str]]:
    """Check the radial depth and the direction against the operation and the tool."""
    radial, direction, operation = row["radial_depth_mm"], row["direction"], row["operation"]
    if diameter is not None and radial > diameter:
        yield "radial_depth_mm", f"found {radial:g}, expected no more than tool.diameter_mm, {diameter:g}"
    if operation == "slot" and diameter is not None and radial < diameter:
        yield (
            "radial_depth_mm",
            f"found {radial:g}, expected tool.diameter_mm, {diameter:g}, for a slot (else: side)",
        )
    if operation in {"slot", "helical"} and direction in {"up", "down"}:
        yield "direction", f'found "{direction}", expected slot, as the operation is {operation}'
    if operation in {"side", "face"} and direction == "slot" and diameter is not None and radial < diameter:
        yield "direction", 'found "slot", expected up or down, as the tool\'s width is not fully engaged'


def _out_of_reach(row: Mapping[str, Any], tool: JSON) -> Iterator[tuple[str, str]]:
    """Report a wall that a rounded tool does not reach: it is narrower than its diameter near the tip."""
    diameter, depth, wide = _length(tool.get("diameter_mm")), row["axial_depth_mm"], row["radial_depth_mm"]
    if diameter is None or not (depth > 0.0 and wide > 0.0):
        return
    corner = 0.5 * diameter if tool.get("end") == "ball" else _length(tool.get("corner_radius_mm")) or 0.0
    if depth >= corner:
        return
    radius = 0.5 * diameter - corner + math.sqrt(depth * (2.0 * corner - depth))
    if radius <= 0.5 * diameter - wide:
        yield (
            "radial_depth_mm",
            f"the tool cuts nothing here: up to axial_depth_mm, {depth:g}, its rounded end reaches "
            f"{radius:.3g} mm from the axis, and the work begins at {0.5 * diameter - wide:.3g} mm (half of "
            f"tool.diameter_mm less {wide:g})",
        )


def _helical(
    row: Mapping[str, Any], diameter: float | None, hole: float | None, hole_unread: bool
) -> Iterator[tuple[str, str]]:
    """Check that a helical run has an orbit and a hole that the tool can make."""
    if not abs(row["orbit_rpm"]) > 0:
        yield "orbit_rpm", "is blank or zero, expected the speed of the orbit of a helical run"
    if hole is None:
        yield from [] if hole_unread else [("operation", f"helical needs {HOLE} in batch.yaml")]
    elif diameter is not None and not diameter < hole < 2 * diameter:
        yield (
            "operation",
            f"{HOLE} {hole:g}: expected between one and two tool diameters ({diameter:g})",
        )
