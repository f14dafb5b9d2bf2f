"""What is said of faces that were levelled: which tables it fills, and what a batch has for it."""

from __future__ import annotations

from metro.batch.capabilities import Capability, Stock, plural
from metro.observables.description import Description
from metro.observables.levelling import NAME, TABLES


def needs(stock: Stock) -> tuple[Capability, ...]:
    """Return what a batch has of slopes; nothing where it has none. Slopes need nothing beside them."""
    levelled = int((stock.runs["slopes"] != "").sum())
    if not levelled:
        return ()
    return (Capability("flatness by slopes", f"{plural(levelled, 'run')} with slopes"),)


LEVELLING = Description(
    name=NAME,
    title="flatness by slopes",
    assumes="",
    tables=TABLES,
    shown=TABLES,
    needs=needs,
)
