"""Rows of a run table for runs that are to be made: after those of a batch, in an order drawn at random."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.columns import RUNS
from metro.batch.files import RUN_FILES
from metro.batch.findings import ContractError, Finding
from metro.batch.runs import SETTINGS, settings_name
from metro.batch.tables import records

DIGITS = 4  # of a setting that is computed
ROLE = "identify"
NOT_COPIED = {*RUN_FILES, "stable", "started_at", "run", "order", "replicate"}
NUMBERS = tuple(column.name for column in RUNS if column.kind == "number")
Limits = Mapping[str, tuple[float, float]]
Row = dict[str, Any]


def row_like(runs: pd.DataFrame, like: str, times: Mapping[str, float], given: Mapping[str, Any]) -> Row:
    """Return the settings of a run as one of a batch, but for some of them.

    Parameters
    ----------
    runs : the batch's run table, by run. times : columns that are so many times as large. given : columns
        with another value.
    """
    source = runs.loc[like]
    row: Row = {column.name: source.get(column.name, "") for column in RUNS if column.name not in NOT_COPIED}
    row["role"] = ROLE
    for column, factor in times.items():
        row[column] = rounded(float(row[column]) * factor)
    row |= {key: rounded(value) if isinstance(value, float) else value for key, value in given.items()}
    row["condition"] = _condition(runs, row)
    return row


def rounded(value: float) -> float:
    """Round to the digits of a machine's setting; a value that is not known stays so."""
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else value


def _condition(runs: pd.DataFrame, row: Row) -> str:
    """Return the condition of the batch that has the settings of a row, else a new one named by them."""
    name = settings_name(row)
    names = pd.Series([settings_name(each) for each in records(runs[[*SETTINGS]])], runs.index, dtype=str)
    same = runs["condition"][names == name]
    return str(same.iloc[0]) if len(same) else name


def within(row: Row, limits: Limits) -> bool:
    """Return whether the settings of a row are within limits; a blank one is."""
    return all(not (row[column] < low or row[column] > high) for column, (low, high) in limits.items())


def limits_of(words: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Read limits written as ``COLUMN=LOW:HIGH``; either end may be left out.

    Raises
    ------
    ContractError
        It is not so written, or the run table has no such column of numbers.
    """
    limits = {}
    for word in words:
        column, _, span = word.partition("=")
        low, colon, high = span.partition(":")
        try:
            ends = float(low or -math.inf), float(high or math.inf)
        except ValueError:
            colon = ""
        if not colon or column not in NUMBERS or ends[0] > ends[1]:
            known = ", ".join(NUMBERS)
            message = f'found "{word}", expected COLUMN=LOW:HIGH, the column one of: {known}'
            raise ContractError([Finding("error", "--limit", message)])
        limits[column] = ends
    return limits


def in_random_order(runs: pd.DataFrame, wanted: Sequence[tuple[Row, int]], seed: int) -> pd.DataFrame:
    """Return the rows of runs to be made so many times each: every round cuts each once, in an order drawn.

    Parameters
    ----------
    runs : the batch's run table, by run: names, places and replicates go on where it ends.
    """
    rng = np.random.default_rng(seed)
    count = runs["condition"].astype(str).value_counts().to_dict()
    place = int(runs["order"].max()) if len(runs) else 0
    names = (f"next-{number:02d}" for number in range(1, 10**6))
    free = (name for name in names if name not in runs.index)
    rows: list[Row] = []
    for number in range(1, max((repeats for _, repeats in wanted), default=0) + 1):
        due = [row for row, repeats in wanted if repeats >= number]
        for i in rng.permutation(len(due)):
            row = due[i]
            count[row["condition"]] = count.get(row["condition"], 0) + 1
            place += 1
            rows.append({**row, "run": next(free), "order": place, "replicate": count[row["condition"]]})
    return pd.DataFrame(rows, columns=[column.name for column in RUNS])
