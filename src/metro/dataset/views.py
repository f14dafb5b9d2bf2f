"""Views over all batches for DuckDB: one for each processed table, and those of the results.

The files stay where the contract has them, ``data/processed/<batch>/<table>.parquet``: the name of the folder
becomes the column ``batch``. Columns are matched by name, so that batches written by different versions of
metro are read together; what a batch does not have is NULL.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from metro.batch.findings import ContractError, Finding
from metro.dataset.results import COLUMNS, rows

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection

# A query reads: nothing is fetched from the net, no Python variable is taken for a table.
SETTINGS = ("autoinstall_known_extensions", "autoload_known_extensions", "python_enable_replacements")


def connect(
    processed: str | Path = "data/processed", reports: str | Path = "reports", sql: str | None = None
) -> DuckDBPyConnection:
    """Return a DuckDB connection, in memory, that has the data set's views.

    Parameters
    ----------
    processed, reports : folders of the processed tables and of the results, one sub-folder for each batch.
    sql : a query; only the views that it names are made then, all where it names none. Making a view reads
        the schema of its file in every batch.

    Raises
    ------
    ContractError
        There is no batch in ``processed``.
    """
    import duckdb

    processed, reports = Path(processed), Path(reports)
    names = view_names(processed)
    words = {word.lower() for word in re.findall(r"\w+", sql or "")}
    connection = duckdb.connect()
    for setting in SETTINGS:
        connection.execute(f"SET {setting} = false")
    for name in [name for name in names if name in words] or names:
        if name in COLUMNS:
            _register(connection, name, processed, reports)
        else:
            _create(connection, name, table_files(processed, name))
    return connection


def view_names(processed: Path) -> list[str]:
    """Return the names of all views: those of the results first, then every table that some batch has."""
    tables = {path.stem for path in _files(processed, "*")}
    if not tables:
        message = "holds no batch with tables: call metro run first, or name the folder with --processed"
        raise ContractError([Finding("error", str(processed), message)])
    return [*COLUMNS, *sorted(tables - set(COLUMNS))]


def table_files(processed: str | Path, table: str) -> list[Path]:
    """Return the files of a table, of all batches that have it.

    A batch that does not have an observed table has a file without columns in its place, which other
    programs refuse to read: those are left out.
    """
    import pyarrow.parquet as pq

    return [path for path in _files(Path(processed), table) if len(pq.read_schema(path))]


def _files(processed: Path, table: str) -> list[Path]:
    """Return files by table name; folders and files that are being written begin with a dot."""
    paths = processed.glob(f"*/{table}.parquet")
    return sorted(path for path in paths if not path.name.startswith(".") and path.parent.name[0] != ".")


def _create(connection: DuckDBPyConnection, name: str, files: list[Path]) -> None:
    """Make the view of a processed table."""
    if not files:
        select = "SELECT NULL::VARCHAR AS batch WHERE false"
    else:
        paths = ", ".join(_quoted(str(path.absolute()), "'") for path in files)
        source = f"read_parquet([{paths}], union_by_name = true, filename = 'path of the file')"
        select = (
            'SELECT parse_path("path of the file")[-2] AS batch, * EXCLUDE ("path of the file") '
            f"FROM {source}"
        )
    connection.execute(f"CREATE VIEW {_quoted(name, chr(34))} AS {select}")


def _register(connection: DuckDBPyConnection, name: str, processed: Path, reports: Path) -> None:
    """Make the view of a kind of results, which are read at once."""
    import pyarrow as pa

    kinds = {"!": pa.string(), "#": pa.int64()}
    schema = pa.schema([(c.rstrip("!#"), kinds.get(c[-1], pa.float64())) for c in COLUMNS[name]])
    records = [dict(zip(schema.names, row, strict=True)) for row in rows(name, processed, reports)]
    connection.register(name, pa.Table.from_pylist(records, schema=schema))


def _quoted(text: str, mark: str) -> str:
    """Write a text or a name as SQL does: in marks, marks inside doubled."""
    return mark + text.replace(mark, 2 * mark) + mark
