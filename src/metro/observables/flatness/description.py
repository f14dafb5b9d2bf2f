"""What is said of the observable ``flatness``: title, assumptions of its model, and its needs."""

from __future__ import annotations

from metro.batch.capabilities import (
    Capability,
    Stock,
    capability,
    count,
    missing_files,
    missing_roles,
    plural,
)
from metro.observables.description import Description
from metro.observables.flatness import NAME, TABLES


def needs(stock: Stock) -> tuple[Capability, ...]:
    """Return what a batch has and lacks for it."""
    runs, loads, coefficients = stock.runs, stock.tables["loads"], stock.missing_coefficients()
    scanned = runs[runs["scan"] != ""]
    planned = runs[(runs["operation"] == "face") & (runs["path"] != "")]
    if scanned.empty and len(planned) and len(loads) and not coefficients:
        source = f"{plural(len(planned), 'planned face')}: a prediction alone"
        return (Capability("flatness", source, ("scan files in runs.csv, to compare with",)),)
    wishes = list(coefficients)
    if not loads[["x_mm", "y_mm", "z_mm"]].notna().all(axis=1).any():
        wishes.append("loads.csv with x_mm, y_mm, z_mm: the stiffness along the path")
    if not (scanned["path"] != "").all():
        wishes.append("path in every run that has a scan")
    if wishes:
        wishes = ["for the prediction:", *wishes]
    source = count(scanned, "a scan") + (" (indices alone)" if wishes else "")
    needs, measured = missing_files(scanned, "scan"), len(scanned) > 0
    return (capability("flatness", source, needs, wishes or missing_roles(scanned), measured=measured),)


DESCRIPTION = Description(
    name=NAME,
    title="deviation of the face",
    assumes=(
        "The face is the answer of the tip to the mean force at each path point; transients at entry "
        "and exit are in the base model where mass.csv gives the arm's mass."
    ),
    tables=TABLES,
    shown=("face_indices", "face_contacts", "face_map"),
    drawn=("face_map",),
    needs=needs,
)
