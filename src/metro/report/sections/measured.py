"""A description of a batch and of its measurements, in words."""

from __future__ import annotations

import pandas as pd

from metro.batch.columns import OWN_TO_A_RUN
from metro.batch.entries import UNKNOWN
from metro.report.numbers import listing
from metro.report.results import Results

ORIGIN = {"measured": "Measured on", "simulated": "Simulated for", "published": "Published values of"}
OF_A_CUT = ("operation", "spindle_rpm", "dynamometer", "robot_log", "idle_log")
UNCUT = {"scan": "scan", "profile": "traced profile", "slopes": "levelled face", "poses": "pose test"}


def count_of(count: int, name: str) -> str:
    """Write a number of things: 1 run, 2 runs."""
    return f"{count} {name}{'' if count == 1 else 's'}"


def measured_words(results: Results) -> str:
    """Describe the batch and its measurements."""
    manifest, runs = results.batch.manifest, results.batch.runs
    cell = str(results.batch.cell.get("cell", manifest.get("cell", UNKNOWN)))
    parts = [f"{ORIGIN.get(str(manifest.get('source')), 'Values of')} cell {cell}"] if cell != UNKNOWN else []
    tool, work = manifest.get("tool") or {}, manifest.get("work") or {}
    if tool.get("diameter_mm"):
        teeth = f", {tool['teeth']} teeth" if tool.get("teeth") else ""
        parts.append(f"tool ⌀{tool['diameter_mm']} mm{teeth}")
    if work.get("material"):
        parts.append(f"work {work['material']}")
    planned = planned_runs(results)
    made = runs[~runs.index.isin(planned)]
    described = "; ".join(parts)
    sentences = [
        f"{described[0].upper()}{described[1:]}." if described else "",
        _run_words(made[is_cut(made)]),
        _uncut_words(made[~is_cut(made)]),
        _planned_words(planned),
        f"Source: {manifest['citation']}" if manifest.get("citation") else "",
    ]
    return " ".join(filter(None, sentences)) or "Neither the machine nor what was measured is described."


def is_cut(runs: pd.DataFrame) -> pd.Series:
    """Mask of the runs that were cuts: with an operation, a speed, or a record of forces or of the arm."""
    cut = pd.Series(False, index=runs.index)
    for column in OF_A_CUT:
        if column in runs:
            cut |= runs[column].notna() & ~runs[column].astype(str).isin(["", "nan"])
    return cut


def _uncut_words(runs: pd.DataFrame) -> str:
    """Say what was measured of parts whose cutting is not described."""
    counts = {
        what: int((runs[column].fillna("").astype(str) != "").sum())
        for column, what in UNCUT.items()
        if column in runs
    }
    listed = listing([count_of(count, what) for what, count in counts.items() if count])
    return f"{listed}, of which no cutting conditions are stated." if listed else ""


def planned_runs(results: Results) -> list[str]:
    """Return the planned runs, which were not cut and on which the study gives advice."""
    advice = (results.identified.get("study") or {}).get("advice") or {}
    return [str(run) for row in advice.get("configurations") or [] for run in row["runs"]]


def _planned_words(planned: list[str]) -> str:
    return (
        f"{count_of(len(planned), 'run')} {'is' if len(planned) == 1 else 'are'} planned, not cut."
        if planned
        else ""
    )


def _run_words(runs: pd.DataFrame) -> str:
    if runs.empty:
        return ""
    free = runs["joint_log"] != "" if "joint_log" in runs else pd.Series(False, runs.index)
    logs = f" {count_of(int(free.sum()), 'joint log')} of a free motion." if free.any() else ""
    runs = runs[~free]
    if runs.empty:
        return logs
    operations = listing([str(o) for o in runs["operation"].dropna().unique() if str(o)])
    one = len(runs) == 1
    made = f"{count_of(len(runs), 'cutting run')} ({operations or 'operation not stated'})"
    judged = bool(runs["role"].isin(["identify", "validate"]).any())
    held = int((runs["role"] == "validate").sum())
    if not judged:
        return (
            f"{made} {'was' if one else 'were'} made; no record of {'it' if one else 'them'} is in the batch."
            f"{logs}"
        )
    named = runs[[name for name in OWN_TO_A_RUN if name in runs]]
    recorded = int((named.notna() & (named != "")).any(axis=1).sum())
    return f"{made}, {recorded or 'none'} of them recorded and {held} held out from all fits.{logs}"
