"""The tables of a batch, CSV or Parquet: read with strict types, every fault with its row and column."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import date, datetime
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.columns import TABLES, Column
from metro.batch.findings import Finding, Severity, linked_outside, shown
from metro.batch.ranges import expected_for, too_small, within
from metro.batch.texts import strange_character
from metro.spelling import suggestion

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
BLANK_NUMBERS = {"nan", "na", "null", "none"}  # what other programs write for "does not apply"
DECIMAL = "a decimal takes a point, not a comma"
LARGEST = 1 << 26  # bytes of a table file: runs, loads and printed values are rows that people write
MOST_CELLS = 10_000_000
MOST_COLUMNS = 1000  # the contract's widest table has 29; every unknown one is named in a message
Row = tuple[int, dict[str, str]]


@dataclass(frozen=True)
class Table:
    """A table as read.

    Attributes
    ----------
    file : its name in messages; "" where there is none.
    frame : all columns of the contract (NaN or "" where blank), one row per row of the file.
    rows : the file's own row number of each.
    faulty : positions of the rows with a cell that could not be read.
    """

    file: str
    frame: pd.DataFrame
    rows: tuple[int, ...] = ()
    faulty: frozenset[int] = field(default=frozenset())

    def finding(self, position: int, column: str, message: str, severity: Severity = "error") -> Finding:
        """Return a finding about the cell in ``column`` of the row at ``position``."""
        label = str(self.frame.iloc[position, 0])
        return Finding(severity, self.file, message, self.rows[position], label, column)

    def sound(self) -> Iterator[tuple[int, Mapping[str, Any]]]:
        """Yield position and content of the rows whose cells could all be read."""
        yield from self._sound

    @cached_property
    def _sound(self) -> list[tuple[int, dict[str, Any]]]:
        """Made once: a dozen rules go through the same rows."""
        rows = enumerate(records(self.frame))
        return [(position, row) for position, row in rows if position not in self.faulty]

    def without(self, out: Collection[int]) -> Table:
        """Return the table less the rows at these positions."""
        kept = [position for position in range(len(self.frame)) if position not in out]
        faulty = frozenset(new for new, old in enumerate(kept) if old in self.faulty)
        frame = self.frame.iloc[kept].reset_index(drop=True)
        return Table(self.file, frame, tuple(self.rows[position] for position in kept), faulty)


def records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows of a table by column, as ``to_dict("records")`` does in many times the time."""
    if frame.empty:
        return []
    columns = [frame[name].tolist() for name in frame]
    names = [str(name) for name in frame]
    return [dict(zip(names, values, strict=True)) for values in zip(*columns, strict=True)]


def read_table(folder: Path, name: str, stem: str | None = None) -> tuple[Table, list[Finding]]:
    """Read a table of the contract; without rows where the folder has no such file.

    Parameters
    ----------
    folder : where the file is.
    name : runs, impacts, loads, mass, published or stations.
    stem : the file's name without suffix, where it is not ``name``.

    Returns
    -------
    The table, and all that is wrong with it.
    """
    columns = TABLES[name]
    there = [folder / f"{stem or name}{suffix}" for suffix in (".csv", ".parquet")]
    there = [path for path in there if path.exists()]
    if not there:
        return Table("", _frame([], columns)), []
    file = there[0].name
    faults = _file_faults(folder, there)
    if faults:
        return Table(file, _frame([], columns)), faults
    header, rows, findings = _read_csv(there[0]) if there[0].suffix == ".csv" else _read_parquet(there[0])
    findings += _header_findings(file, header, columns) if header else []
    if any(finding.severity == "error" for finding in findings):
        return Table(file, _frame([], columns)), findings
    return _typed(file, rows, columns, findings)


def _file_faults(folder: Path, there: list[Path]) -> list[Finding]:
    """Report what keeps a table's file from being read at all."""
    file = there[0].name
    if not there[0].is_file():
        return [Finding("error", file, "is a folder, expected a table")]
    if len(there) > 1:
        return [Finding("error", file, f"there is {there[1].name} too: keep one")]
    size = there[0].stat().st_size
    if size > LARGEST:
        return [Finding("error", file, f"has {size} bytes, expected at most {LARGEST}")]
    return linked_outside(folder, there[0], file)


def _read_csv(path: Path) -> tuple[list[str], list[Row], list[Finding]]:
    """Read header and rows of a CSV file as text, without blank lines and stray spaces."""
    file, findings, rows = path.name, [], []
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as fault:
        return (
            [],
            [],
            [Finding("error", file, f"is not UTF-8 text (byte {fault.start + 1}): save it as UTF-8")],
        )
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        message = "found a NUL character, expected text: the file is damaged, copy or export it again"
        return [], [], [Finding("error", file, message, line)]
    reader = csv.reader(io.StringIO(text, newline=""), skipinitialspace=True, strict=True)
    header: list[str] = []
    try:
        for cells in ([cell.strip() for cell in line] for line in reader):
            row = reader.line_num
            if not any(cells):
                continue
            if not header:
                header = cells
                continue
            extra = [cell for cell in cells[len(header) :] if cell]
            if extra:
                message = f"found {len(cells)} values, expected {len(header)} ({DECIMAL})"
                findings.append(Finding("error", file, message, row, cells[0]))
            elif len(cells) < len(header):
                message = (
                    f"found {len(cells)} values, expected {len(header)}: missing values are taken as blank"
                )
                findings.append(Finding("warning", file, message, row, cells[0]))
            rows.append((row, dict(zip(header, cells + [""] * len(header), strict=False))))
    except csv.Error as fault:
        findings.append(Finding("error", file, f"cannot be read as CSV: {fault}", reader.line_num))
    if not header:
        findings.append(Finding("error", file, "is empty, expected a header and rows"))
    return header, rows, findings


def _read_parquet(path: Path) -> tuple[list[str], list[Row], list[Finding]]:
    """Read header and rows of a Parquet file as text; the first row is row 1."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        stored = pq.ParquetFile(path)
        count = stored.metadata.num_rows * stored.metadata.num_columns
        if count > MOST_CELLS:
            message = f"has {count} cells, expected at most {MOST_CELLS}"
            return [], [], [Finding("error", path.name, message)]
        # Pandas' own metadata in the file are ignored: names and types are those of the columns.
        frame = stored.read().to_pandas(ignore_metadata=True)
        header = [str(name) for name in frame.columns]
        columns = [[_as_text(value) for value in frame.iloc[:, place]] for place in range(len(header))]
    except (OSError, ValueError, pa.ArrowException) as fault:
        return [], [], [Finding("error", path.name, f"cannot be read as Parquet: {fault}")]
    cells = zip(*columns, strict=True)
    return header, [(row, dict(zip(header, values, strict=True))) for row, values in enumerate(cells, 1)], []


def _as_text(value: Any) -> str:
    """Write a value of a Parquet table as a CSV file would hold it, without loss."""
    if value is None or value is pd.NA or value is pd.NaT or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float) and value.is_integer():
        return str(int(value))
    return value.isoformat() if isinstance(value, date | datetime) else str(value).strip()


def _header_findings(file: str, header: list[str], columns: tuple[Column, ...]) -> Iterator[Finding]:
    """Check the header: separators, columns that appear twice, are unknown, or are missing."""
    known = [column.name for column in columns]
    if len(header) > MOST_COLUMNS:
        message = (
            f"has {len(header)} columns, expected at most {MOST_COLUMNS}: is it the table that is meant?"
        )
        yield Finding("error", file, message)
        return
    for mark, word in ((";", "semicolons"), ("\t", "tabs")):
        if len(header) == 1 and mark in header[0]:
            message = f"its columns are separated by {word}, expected commas (and decimals with a point)"
            yield Finding("error", file, message)
            return
    for name in dict.fromkeys(name for name in header if header.count(name) > 1 and name):
        yield Finding("error", file, "appears twice", column=name)
    for name in header:
        if name and name not in known:
            message = f"is not a known column and is not read{suggestion(name, known)}"
            yield Finding("warning", file, message, column=name)
    for column in columns:
        if column.required and column.name not in header:
            hint = suggestion(column.name, [name for name in header if name and name not in known])
            yield Finding("error", file, f"is missing{hint}, expected {column.expected}", column=column.name)


def _typed(
    file: str, rows: list[Row], columns: tuple[Column, ...], findings: list[Finding]
) -> tuple[Table, list[Finding]]:
    """Turn text into values, column by column; a cell that is not what it should be is left blank."""
    values: list[dict[str, Any]] = []
    faulty = set()
    for position, (row, cells) in enumerate(rows):
        values.append({})
        for column in columns:
            text = cells.get(column.name, "")
            value, fault = _value(text, column)
            values[-1][column.name] = value
            if fault:
                findings.append(
                    Finding("error", file, fault, row, cells.get(columns[0].name, ""), column.name)
                )
                faulty.add(position)
    if not rows:
        findings.append(Finding("warning", file, "has a header but no rows"))
    frame = _frame(values, columns)
    return Table(file, frame, tuple(row for row, _ in rows), frozenset(faulty)), findings


def _frame(values: list[dict[str, Any]], columns: tuple[Column, ...]) -> pd.DataFrame:
    """Return the values as a table with the contract's columns and types."""
    if not values:
        return _without_rows(columns).copy()
    cells = {column: [row[column.name] for row in values] for column in columns}
    return pd.DataFrame(
        {
            column.name: np.array(listed, dtype=float) if column.numeric else pd.array(listed, dtype="str")
            for column, listed in cells.items()
        }
    )


@cache
def _without_rows(columns: tuple[Column, ...]) -> pd.DataFrame:
    """Return the table of a file that is not there, which most batches have several of."""
    frame = pd.DataFrame([], columns=[column.name for column in columns])
    return frame.astype({column.name: float if column.numeric else str for column in columns})


def _value(text: str, column: Column) -> tuple[Any, str | None]:
    """Return a cell's value, blank where it has none, and what is wrong with it."""
    blank: Any = math.nan if column.numeric else ""
    if not text or (column.numeric and text.lower() in BLANK_NUMBERS):
        return blank, f"is blank, expected {column.expected}" if column.required else None
    if fault := strange_character(text):
        return blank, f"{fault}, expected {column.expected}"
    value = _number(text) if column.numeric else text
    if value is not None and _allowed(value, column):
        return value, None
    return blank, f"found {shown(text)}, expected {_expected(text, value, column)}"


def _expected(text: str, value: Any, column: Column) -> str:
    """Say what a column expects in place of a cell that it does not allow; ``value``: None for no number."""
    if not column.numeric:
        long = "" if column.choices or len(text) <= column.longest else f"at most {column.longest} characters"
        return long or f"{column.expected}{suggestion(text, column.choices)}"
    if value is not None:
        return too_small(value) or expected_for(column.rule, value)
    comma = NUMBER.fullmatch(text.replace(",", ".", 1)) if "," in text else None
    return column.expected + (f" ({DECIMAL})" if comma else "")


def _number(text: str) -> float | None:
    """Return a number as people and programs write it; None where the text is something else."""
    value = float(text) if NUMBER.fullmatch(text) else math.inf
    return value if math.isfinite(value) else None


def _allowed(value: Any, column: Column) -> bool:
    """Return whether a value is one that the column may hold."""
    if column.choices:
        return value in column.choices
    if column.numeric:
        usable = within(column.rule, value) and not too_small(value)
        return usable and (column.kind == "number" or float(value).is_integer())
    if len(value) > column.longest:
        return False
    if column.kind == "time":
        try:
            datetime.fromisoformat(value)
        except ValueError:
            return False
    return not column.pattern or re.fullmatch(column.pattern, value) is not None
