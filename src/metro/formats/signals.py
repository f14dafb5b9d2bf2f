"""Tables of a signal, a path, a profile or an FRF: CSV, Parquet and NumPy archives."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from metro.formats.channels import Channel, parted, translated
from metro.formats.contents import Contents, Own
from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw, columns_to_read
from metro.formats.limits import check_archive, check_unpacked
from metro.formats.text import Layout, fields, is_number, lines, number_pieces, separator

_ARRAYS = ("freq_hz", "frf", "coherence")
_BUFFER = 1 << 20  # bytes of a Parquet file that are read at once


def csv_pieces(path: Path, kind: Kind, rows: int | None) -> Iterator[Raw]:
    """Read a CSV table in pieces: a header line, columns parted by commas or tabs, ``#`` comments.

    Extra columns are ignored; the case of names and the spaces around them do not matter. A name may
    state its unit: ``Fx [kN]``, ``force_x_N``.
    """
    number, header = next(lines(path), (0, ""))
    if not header:
        raise FormatError(path, f"is empty, expected {kind.title}")
    parted_by = separator(path, number, header)
    own = fields(header, parted_by)
    if all(is_number(name) for name in own):
        message = (
            f"line {number}: found numbers, expected a header with the columns {', '.join(kind.required)}"
        )
        raise FormatError(path, f"{message}, or a mapping under files in batch.yaml that numbers them")
    names, factors = translated(path, kind, [f"line {number}"] * len(own), own)
    use = columns_to_read(path, kind, names)
    layout = Layout(tuple(names), parted_by, number)
    for raw in number_pieces(path, layout, use, rows):
        yield Raw(raw.frame * factors[use], raw.place)


def parquet_pieces(path: Path, kind: Kind, rows: int | None) -> Iterator[Raw]:
    """Read a Parquet table in pieces of so many rows, or at once; column names as in CSV."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        # without a buffer of its own Arrow keeps what it has read of all row groups
        file = pq.ParquetFile(path, pre_buffer=False, buffer_size=_BUFFER)
        stored = file.schema_arrow.names
        names, factors = translated(path, kind, [f"column {name}" for name in stored], stored)
        use = columns_to_read(path, kind, names)
        wanted = {stored[names.index(name)]: name for name in use}
        _check_numeric(path, {name: file.schema_arrow.field(key).type for key, name in wanted.items()})
        check_unpacked(path, _unpacked(file.metadata, wanted, whole=rows is None), kind.title)
        start = 0
        for table in _tables(file, list(wanted), rows):
            columns = {
                name: table[key].to_numpy().astype(np.float64) * factors[name] for key, name in wanted.items()
            }
            yield Raw(pd.DataFrame(columns), partial(_row, start))
            start += table.num_rows
    except (pa.ArrowException, OSError, ValueError) as error:  # of a damaged file, Arrow raises any of them
        raise FormatError(path, f"is not a readable Parquet file: {error}") from error


def _tables(file: Any, columns: list[str], rows: int | None) -> Iterator[Any]:
    """Yield an Arrow table per piece; one without rows where the file has none."""
    import pyarrow as pa

    if rows is None or not file.metadata.num_rows:
        yield file.read(columns=columns)
        return
    for batch in file.iter_batches(batch_size=rows, columns=columns, use_threads=False):
        yield pa.Table.from_batches([batch])


def _row(start: int, row: int) -> str:
    return f"row {start + row + 1}"


def _unpacked(metadata: Any, columns: Iterable[str], *, whole: bool) -> int:
    """Return the bytes of so many columns as float64, or as the file states their pages unpacked, if more.

    Of the ``whole`` file, or else of its largest row group.
    """
    groups = [metadata.row_group(i) for i in range(metadata.num_row_groups)]
    width = 8 * len(list(columns))
    sizes = [
        max(
            width * group.num_rows,
            sum(group.column(i).total_uncompressed_size for i in range(group.num_columns)),
        )
        for group in groups
    ]
    return int(sum(sizes) if whole else max(sizes, default=0))


def _check_numeric(path: Path, types: dict[str, object]) -> None:
    import pyarrow as pa

    for name, kind in types.items():
        if not (pa.types.is_floating(kind) or pa.types.is_integer(kind)):
            raise FormatError(path, f"column {name}: found values of type {kind}, expected numbers")


def parquet_contents(path: Path) -> Contents:
    """Find the columns of numbers of a Parquet table."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        schema = pq.read_schema(path)
    except (pa.ArrowException, OSError, ValueError) as error:
        raise FormatError(path, f"is not a readable Parquet file: {error}") from error
    numeric = [
        each.name for each in schema if pa.types.is_floating(each.type) or pa.types.is_integer(each.type)
    ]
    columns = tuple(Own(f"column {name}", name, parted(name)[1]) for name in numeric)
    names = {each.label: each.name for each in columns}

    def pieces(labels: Sequence[str], rows: int | None) -> Iterator[Raw]:
        own = tuple(names[label] for label in labels)
        for raw in parquet_pieces(path, Kind("a table", tuple(name.strip().lower() for name in own)), rows):
            yield Raw(raw.frame.set_axis(list(labels), axis=1), raw.place)

    return Contents("Parquet", columns, pieces)


@contextmanager
def npz_channels(path: Path) -> Iterator[list[Channel]]:
    """Open a NumPy archive and give its arrays of numbers."""
    with _arrays(path, "an archive of arrays") as archive:
        arrays = {name: np.squeeze(archive[name]) for name in archive.files}
    yield [
        Channel(
            f"array {name}",
            name,
            "",
            each.shape,
            each.dtype.kind in "iuf",
            partial(_some, each),
            pairs=each.dtype.kind == "c",
        )
        for name, each in arrays.items()
    ]


def _some(array: np.ndarray, some: slice) -> np.ndarray:
    return array.ravel(order="F")[some]


@contextmanager
def _arrays(path: Path, title: str) -> Iterator[Any]:
    try:
        check_archive(path, title)
        with np.load(path, allow_pickle=False) as archive:
            yield archive
    except FormatError:
        raise
    except Exception as error:  # whatever a damaged archive makes its reader stumble over
        message = f"is not a readable NumPy archive: {error or type(error).__name__}"
        raise FormatError(path, message) from error


def read_npz(path: Path, kind: Kind, rows: int | None) -> Raw:
    """Read an FRF from a NumPy archive: ``freq_hz``, ``frf`` (complex e^{+iωt}), ``coherence``, each (n,)."""
    with _arrays(path, kind.title) as archive:
        present = archive.files
        arrays = {
            name: np.atleast_1d(np.squeeze(archive[name]))[:rows] for name in _ARRAYS if name in present
        }
    missing = [name for name in ("freq_hz", "frf") if name not in arrays]
    if missing:
        listed = ", ".join(present) or "none"
        raise FormatError(path, f"lacks the array {', '.join(missing)} of {kind.title}: found {listed}")
    for name, array in arrays.items():
        if array.ndim != 1 or array.shape != arrays["freq_hz"].shape:
            expected = f"({arrays['freq_hz'].size},), one value per line of freq_hz"
            raise FormatError(path, f"array {name}: found shape {array.shape}, expected {expected}")
        if array.dtype.kind not in ("iufc" if name == "frf" else "iuf"):
            raise FormatError(path, f"array {name}: found values of type {array.dtype}, expected numbers")
    frf = arrays["frf"]
    columns = {"frequency_hz": arrays["freq_hz"], "real": frf.real, "imag": frf.imag}
    if "coherence" in arrays:
        columns["coherence"] = arrays["coherence"]
    return Raw(pd.DataFrame(columns).astype(np.float64), lambda row: f"line {row + 1}")
