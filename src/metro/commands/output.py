"""How commands print: rich tables for people, JSON and CSV for programs."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterable, Sequence
from decimal import Decimal
from typing import Any


def print_json(content: Any) -> None:
    """Print JSON: numbers that JSON cannot hold become null, and values without a JSON type become text."""
    sys.stdout.write(json.dumps(_plain(content), indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def print_csv(header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Print comma-separated values with a header; a value that is not known is an empty cell."""
    import csv

    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)


def print_table(header: Sequence[str], rows: Iterable[Sequence[Any]], title: str | None = None) -> None:
    """Print a table for people; numbers have six digits and are aligned to the right."""
    from rich.console import Console
    from rich.table import Table

    shown = [list(row) for row in rows]
    table = Table(show_edge=False, pad_edge=False, header_style="bold", title=title, title_justify="left")
    for place, name in enumerate(header):
        numbers = bool(shown) and all(isinstance(row[place], int | float | None) for row in shown)
        table.add_column(name, justify="right" if numbers else "left", overflow="fold")
    for row in shown:
        table.add_row(*map(_cell, row))
    Console(highlight=False, markup=False).print(table)


def _cell(value: Any) -> Any:
    from rich.text import Text

    if isinstance(value, Text):
        return value
    if value is None:
        return Text("–", style="dim")
    return Text(f"{value:.6g}" if isinstance(value, float | Decimal) else str(value))


def _plain(value: Any) -> Any:
    """Return a value in the types that JSON has."""
    if isinstance(value, dict):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    if isinstance(value, Decimal):
        return float(value)
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, bool | int | str) else str(value)
