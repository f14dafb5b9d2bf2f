"""``metro query``: SQL over the tables and results of all batches."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from metro.batch.findings import ContractError, Finding
from metro.commands.calls import wrong_call
from metro.commands.output import print_csv, print_json, print_table
from metro.dataset.views import connect, view_names

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection

MOST_SHOWN = 200
CHUNK = 10_000


def query(sql: str, processed: Path, reports: Path, as_json: bool, as_csv: bool) -> None:
    """Print the answer to a query; without a query, list the views with their columns.

    Raises
    ------
    CallError
        Two forms of output are asked for.
    ContractError
        The SQL is not one statement that only reads, or DuckDB cannot carry it out.
    """
    if as_json and as_csv:
        raise wrong_call("--json", "found --csv, too, expected one of them")
    if not sql.strip():
        header, rows = _views(processed, reports)
    else:
        header, rows = _answer(connect(processed, reports, sql), sql)
    if as_json:
        print_json([dict(zip(header, row, strict=True)) for row in rows])
    elif as_csv:
        print_csv(header, rows)
    else:
        print_table(header, islice(rows, MOST_SHOWN))
        if next(rows, None) is not None:
            import typer

            typer.echo(f"… more rows than {MOST_SHOWN}: --csv and --json give all of them", err=True)


def _answer(connection: DuckDBPyConnection, sql: str) -> tuple[list[str], Iterator[tuple[Any, ...]]]:
    import duckdb

    try:
        statements = connection.extract_statements(sql)
        if [statement.type for statement in statements] != [duckdb.StatementType.SELECT]:
            message = "expected one statement that only reads: SELECT, WITH, FROM, DESCRIBE or SUMMARIZE"
            raise ContractError([Finding("error", "query", message)])
        connection.execute(sql)
    except duckdb.Error as error:
        raise ContractError([Finding("error", "query", str(error).strip())]) from None
    return _unique([str(column[0]) for column in connection.description or []]), _rows(connection)


def _rows(connection: DuckDBPyConnection) -> Iterator[tuple[Any, ...]]:
    while chunk := connection.fetchmany(CHUNK):
        yield from chunk


def _views(processed: Path, reports: Path) -> tuple[list[str], Iterator[tuple[Any, ...]]]:
    """List every view with its number of rows and its columns."""
    connection = connect(processed, reports)
    views = []
    for name in view_names(processed):
        columns = connection.table(name).columns
        (count,) = connection.sql(f'SELECT count(*) FROM "{name}"').fetchall()[0]
        views.append((name, count, ", ".join(columns)))
    return ["view", "rows", "columns"], iter(views)


def _unique(names: list[str]) -> list[str]:
    """Give numbers to columns that share a name, because a JSON object can hold each name only once."""
    return [f"{name}_{names[:i].count(name)}" if name in names[:i] else name for i, name in enumerate(names)]
