"""Tables of a signal, a path, a profile or an FRF: CSV, Parquet and NumPy archives."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pandas as pd

from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw, columns_to_read
from metro.formats.text import Layout, fields, is_number, lines, numbers, separator


def read_csv(path: Path, kind: Kind, rows: int | None) -> Raw:
    """Read a CSV table: a header line, columns parted by commas or tabs, ``#`` comments.

    Extra columns are ignored; the case of names and the spaces around them do not matter.
    """
    number, header = next(lines(path), (0, ""))
    if not header:
        raise FormatError(path, f"is empty, expected {kind.title}")
    parted_by = separator(path, number, header)
    names = [field.lower() for field in fields(header, parted_by)]
    if all(is_number(name) for name in names):
        message = (
            f"line {number}: found numbers, expected a header with the columns {', '.join(kind.required)}"
        )
        raise FormatError(path, message)
    return numbers(path, Layout(tuple(names), parted_by, number), columns_to_read(path, kind, names), rows)


def read_parquet(path: Path, kind: Kind, rows: int | None) -> Raw:
    """Read a Parquet table; column names as in CSV."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        file = pq.ParquetFile(path)
        stored = file.schema_arrow.names
        names = [name.strip().lower() for name in stored]
        use = columns_to_read(path, kind, names)
        wanted = {stored[names.index(name)]: name for name in use}
        _check_numeric(path, {name: file.schema_arrow.field(key).type for key, name in wanted.items()})
        if rows is None:
            table = file.read(columns=list(wanted))
        else:
            batches = file.iter_batches(batch_size=rows, columns=list(wanted))
            table = pa.Table.from_batches([batch for batch, _ in zip(batches, range(1), strict=False)])
    except pa.ArrowException as error:
        raise FormatError(path, f"is not a readable Parquet file: {error}") from error
    columns = {name: table[key].to_numpy().astype(np.float64) for key, name in wanted.items()}
    return Raw(pd.DataFrame(columns), lambda row: f"row {row + 1}")


def _check_numeric(path: Path, types: dict[str, object]) -> None:
    import pyarrow as pa

    for name, kind in types.items():
        if not (pa.types.is_floating(kind) or pa.types.is_integer(kind)):
            raise FormatError(path, f"column {name}: found values of type {kind}, expected numbers")


def read_npz(path: Path, kind: Kind, rows: int | None) -> Raw:
    """Read an FRF from a NumPy archive: ``freq_hz``, ``frf`` (complex e^{+iωt}), ``coherence``, each (n,)."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: np.squeeze(archive[name])[:rows] for name in archive.files}
    except (ValueError, OSError, zipfile.BadZipFile) as error:
        raise FormatError(path, f"is not a readable NumPy archive: {error}") from error
    missing = [name for name in ("freq_hz", "frf") if name not in arrays]
    if missing:
        found = ", ".join(arrays) or "none"
        raise FormatError(path, f"lacks the array {', '.join(missing)} of {kind.title}: found {found}")
    for name, array in arrays.items():
        if name in ("freq_hz", "frf", "coherence") and array.shape != arrays["freq_hz"].shape:
            shape = f"found shape {array.shape}, expected {arrays['freq_hz'].shape} as freq_hz has"
            raise FormatError(path, f"array {name}: {shape}")
        if name in ("freq_hz", "frf", "coherence") and not np.issubdtype(array.dtype, np.number):
            raise FormatError(path, f"array {name}: found values of type {array.dtype}, expected numbers")
    frf = arrays["frf"]
    columns = {"frequency_hz": arrays["freq_hz"], "real": frf.real, "imag": frf.imag}
    if "coherence" in arrays:
        columns["coherence"] = arrays["coherence"]
    return Raw(pd.DataFrame(columns).astype(np.float64), lambda row: f"line {row + 1}")
