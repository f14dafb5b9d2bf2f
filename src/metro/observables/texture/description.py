"""What is said of surface texture: which tables it fills, and what a batch has for it."""

from __future__ import annotations

from metro.batch.capabilities import Capability, Stock, plural
from metro.observables.description import Description
from metro.observables.texture import NAME, TABLES


def needs(stock: Stock) -> tuple[Capability, ...]:
    """Return what a batch has of traces; nothing where it has none. A trace needs nothing beside it."""
    traced = int((stock.runs["profile"] != "").sum())
    if not traced:
        return ()
    return (Capability("surface texture", f"{plural(traced, 'run')} with a profile"),)


TEXTURE = Description(
    name=NAME,
    title="surface texture",
    assumes="",
    tables=TABLES,
    shown=TABLES,
    needs=needs,
)
