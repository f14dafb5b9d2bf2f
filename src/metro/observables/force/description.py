"""What is said of the observable ``force``: title, assumptions of its model, and its needs."""

from __future__ import annotations

from metro.batch.capabilities import (
    TOOL,
    Capability,
    Stock,
    capability,
    count,
    described,
    missing_files,
    missing_roles,
)
from metro.observables.description import Description
from metro.observables.force import NAME, TABLES


def needs(stock: Stock) -> tuple[Capability, ...]:
    """Return what a batch has and lacks for it."""
    runs = stock.runs[stock.runs["dynamometer"] != ""]
    usable, blank = described(runs)
    needs = [*missing_files(runs, "dynamometer"), *stock.missing_keys(TOOL)]
    needs += [] if len(usable) else blank
    source, wishes = count(usable, "a dynamometer file"), [*blank, *missing_roles(usable)]
    return (capability("force", source, needs, wishes, measured=len(runs) > 0),)


DESCRIPTION = Description(
    name=NAME,
    title="cutting force",
    assumes=(
        "The force model is mechanistic and linear in its coefficients: one edge force, one pressure, "
        "no dependence on temperature or speed; the tool is rigid unless an effect says otherwise."
    ),
    tables=TABLES,
    shown=("spindle", "yielding"),
    drawn=(),
    needs=needs,
)
