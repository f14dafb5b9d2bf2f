"""The types of the canonical tables, and a writer that takes a table part by part, since scans are large."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
import pandas as pd

from metro import __version__
from metro.batch.processed import COLUMNS
from metro.batch.writing import write_atomically

# Rows that belong together (a run's record): arrays of one length, and values that hold for all of its rows.
Part = Mapping[str, np.ndarray | pd.Series | str | int]

_TEXT = {
    *("run", "log", "test", "position", "reference", "response", "response_unit", "pose", "point"),
    *("table", "row", "observable", "quantity", "axis", "unit", "note", "file", "check", "message"),
    *("touched", "loaded"),
}
_WHOLE = {("path", "point"), ("path", "pass"), ("hit", "replicate"), ("frf", "replicate"), ("slopes", "line")}


def schema(table: str) -> Any:
    """Return the Arrow schema of a canonical table: text, whole numbers, yes or no, else float64."""
    import pyarrow as pa

    def kind(column: str) -> Any:
        if (table, column) in _WHOLE:
            return pa.int64()
        if column in _TEXT:
            return pa.string()
        return pa.bool_() if column == "ok" else pa.float64()

    return pa.schema([(column, kind(column)) for column in COLUMNS[table]])


def write_parts(path: Path, table: str, parts: Iterable[Part], provenance: Mapping[str, str]) -> None:
    """Write a canonical table atomically, a row group per part; without parts it has its columns and no rows.

    Parameters
    ----------
    parts : a column of the table that a part lacks is null in its rows.
    provenance : entries of the schema metadata, beside the version of the code.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    metadata = {"metro.version": __version__} | {f"metro.{key}": text for key, text in provenance.items()}
    fields = schema(table).with_metadata(metadata)

    def write(stream: IO[bytes]) -> None:
        with pq.ParquetWriter(stream, fields, compression="zstd") as writer:
            for part in parts:
                rows = max(len(value) for value in part.values() if not isinstance(value, str | int))
                columns = [_column(part.get(field.name), field.type, rows) for field in fields]
                writer.write_table(pa.table(columns, schema=fields), row_group_size=max(rows, 1))

    write_atomically(path, write)


def _column(value: np.ndarray | pd.Series | str | int | None, kind: Any, rows: int) -> Any:
    import pyarrow as pa

    if value is None:
        return pa.nulls(rows, kind)
    if isinstance(value, str | int):
        return pa.repeat(pa.scalar(value, kind), rows)
    return pa.array(value, kind)
