"""What is said of printed values: which tables they fill, and what a batch has of them."""

from __future__ import annotations

from metro.batch.capabilities import Capability, Stock
from metro.observables.description import Description
from metro.observables.published import TABLES


def needs(stock: Stock) -> tuple[Capability, ...]:
    """Return what a batch has of printed values; nothing where it has none."""
    rows = stock.tables["published"]
    if rows.empty:
        return ()
    pairs = int(rows[["measured", "predicted"]].notna().all(axis=1).sum())
    return (Capability("printed values", f"{len(rows)} rows of published.csv, {pairs} of them pairs"),)


PRINTED = Description(
    name="published",
    title="printed values",
    assumes="",
    tables=TABLES,
    shown=("published_errors", "published_modes", "published_loads", "published_forces"),
    needs=needs,
)
