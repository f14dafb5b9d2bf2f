"""What is said of the observable ``force``: title, assumptions of its model, and its needs."""

from __future__ import annotations

import pandas as pd

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
from metro.observables.force.bottom_edges import advice
from metro.units import MM


def needs(stock: Stock) -> tuple[Capability, ...]:
    """Return what a batch has and lacks for it."""
    runs = stock.runs[stock.runs["dynamometer"] != ""]
    usable, blank = described(runs)
    needs = [*missing_files(runs, "dynamometer"), *stock.missing_keys(TOOL)]
    needs += [] if len(usable) else blank
    source, wishes = (
        count(usable, "a dynamometer file"),
        [*blank, *missing_roles(usable), *_feeds(stock, runs)],
    )
    return (capability("force", source, needs, wishes, measured=len(runs) > 0),)


def _feeds(stock: Stock, runs: pd.DataFrame) -> list[str]:
    """Say which axial feeds the helical runs lack to determine the coefficients of the bottom edges."""
    teeth = (stock.manifest.get("tool") or {}).get("teeth")
    holes = runs[(runs["operation"] == "helical") & (runs["role"] == "identify")]
    known = holes[["axial_depth_mm", "orbit_rpm", "spindle_rpm"]].dropna()
    if not teeth or known.empty:
        return []
    per_tooth = known["axial_depth_mm"] * MM * known["orbit_rpm"].abs() / (known["spindle_rpm"] * teeth)
    said = advice([float(feed) for feed in per_tooth])
    return [f"K_Fac: {said}"] if said else []


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
