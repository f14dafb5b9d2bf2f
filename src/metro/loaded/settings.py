"""The settings of a cut that a user asks about, as a row of the run table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import pandas as pd

from metro.batch.batch import Batch
from metro.batch.columns import RUNS, Column
from metro.batch.findings import ContractError, Finding
from metro.spelling import suggestion

ASKED = "asked for"  # name of the row
# Columns of the run table that a prediction depends on; the last one is counted, not written by people.
COLUMNS = {
    column.name: column
    for column in RUNS
    if column.name
    in {
        *("operation", "direction", "spindle_rpm", "feed_per_tooth_mm", "axial_depth_mm", "radial_depth_mm"),
        *("orbit_rpm", "feed_direction_deg", "cut_length_mm", "pose"),
    }
} | {"cut_before_m": Column("cut_before_m", "number")}


def asked_for(batch: Batch, run: str | None, settings: Mapping[str, Any]) -> Batch:
    """Return the batch with a further row, :data:`ASKED`: the settings of a run with some of them replaced.

    Parameters
    ----------
    run : a run of the batch; None: its first one.
    settings : column of ``runs.csv`` → value, in the column's unit.

    Raises
    ------
    ContractError
        There is no such run or column, or a value is none that the column may hold.
    """
    known = [str(name) for name in batch.runs.index]
    if not known:
        raise wrong(batch.name, "has no run that the other settings could be taken from")
    if run is not None and run not in known:
        raise wrong(run, f"{batch.name} has no such run{suggestion(run, known)}")
    faults = list(_faults(settings))
    if faults:
        raise ContractError(faults)
    row = batch.runs.loc[run or known[0]].to_dict() | dict(settings)
    if row["operation"] in ("slot", "helical"):
        row["direction"] = "slot"
    added = pd.DataFrame([row], index=[ASKED]).astype(batch.runs.dtypes.to_dict())
    return replace(batch, runs=pd.concat([batch.runs, added]))


def wrong(what: str, message: str) -> ContractError:
    """Return the error for a part of a call."""
    return ContractError([Finding("error", what, message)])


def _faults(settings: Mapping[str, Any]) -> Iterator[Finding]:
    """Find names and values that the run table could not have."""
    for name, value in settings.items():
        column = COLUMNS.get(name)
        if column is None:
            expected = suggestion(name, list(COLUMNS)) or f"; expected one of: {', '.join(COLUMNS)}"
            yield Finding("error", name, f"is no setting of a cut{expected}")
        elif not _allowed(column, value):
            yield Finding("error", name, f"found {value!r}, expected {column.expected}")


def _allowed(column: Column, value: Any) -> bool:
    """Return whether a column may hold a value."""
    if not column.numeric:
        return not column.choices or value in column.choices
    rule = column.rule
    return isinstance(value, int | float) and bool(
        rule.get("minimum", value) <= value <= rule.get("maximum", value)
        and value > rule.get("exclusiveMinimum", -float("inf"))
        and value < rule.get("exclusiveMaximum", float("inf"))
    )
