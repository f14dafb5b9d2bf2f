"""What the rows of impacts, loads, mass and stations must fulfil beyond the type of each cell."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from metro.batch.findings import Finding
from metro.batch.tables import Table

SELF_DESCRIBING = (".uff", ".unv", ".uf")  # universal files carry points, axes, kind and unit themselves


def impact_findings(table: Table) -> Iterator[Finding]:
    """Check that a hammer record or FRF says where, and in what unit, it was taken."""
    for position, row in table.sound():
        if str(row["file"]).lower().endswith(SELF_DESCRIBING):
            continue
        for column in ("reference", "response", "kind"):
            if not row[column]:
                yield table.finding(position, column, "is blank, expected as the file does not carry it")
        if row["kind"] == "record" and not row["response_unit"]:
            yield table.finding(position, "response_unit", "is blank, expected m/s2 or m/s or m or g")
    yield from _named_twice(table)


def load_findings(table: Table) -> Iterator[Finding]:
    """Check that a load test has a place, a load and an answer."""
    for position, row in table.sound():
        joints = [math.isfinite(row[f"q{i}_deg"]) for i in range(1, 7)]
        if any(joints) and not all(joints):
            yield table.finding(
                position, f"q{joints.index(False) + 1}_deg", "is blank, expected all six joint angles"
            )
        if not any(joints) and not all(math.isfinite(row[name]) for name in ("x_mm", "y_mm", "z_mm")):
            message = (
                "neither joint angles nor x_mm, y_mm, z_mm: the row tells nothing of where it was loaded"
            )
            yield table.finding(position, "", message, "warning")
        if not any(row[name] for name in ("fx_n", "fy_n", "fz_n")):
            yield table.finding(position, "fx_n", "the load is zero, expected a force")
        if not any(math.isfinite(row[name]) for name in ("dx_mm", "dy_mm", "dz_mm")):
            yield table.finding(position, "dx_mm", "dx_mm, dy_mm, dz_mm are all blank, expected at least one")


def mass_findings(table: Table) -> Iterator[Finding]:
    """Check that a reduced mass matrix is one: positive definite."""
    for position, row in table.sound():
        xx, xy, xz, yy, yz, zz = (row[name] for name in ("mxx", "mxy", "mxz", "myy", "myz", "mzz"))
        if np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])[0] <= 0:
            yield table.finding(position, "mxx", "the mass matrix of this row is not positive definite")


def published_findings(table: Table) -> Iterator[Finding]:
    """Check that a printed row holds a value."""
    for position, row in table.sound():
        if math.isnan(row["measured"]) and math.isnan(row["predicted"]):
            yield table.finding(
                position, "measured", "measured and predicted are both blank, expected at least one"
            )


def station_findings(table: Table) -> Iterator[Finding]:
    """Check that no station is tabulated twice."""
    for position, name in enumerate(table.frame["position"]):
        if name in list(table.frame["position"][:position]):
            yield table.finding(position, "position", f'position "{name}" stands twice')


def _named_twice(table: Table) -> Iterator[Finding]:
    """Warn of a file that two rows name."""
    files = list(table.frame["file"])
    for position, name in enumerate(files):
        first = files.index(name)
        if name and first < position and not name.lower().endswith(SELF_DESCRIBING):
            yield table.finding(
                position, "file", f'"{name}" stands in row {table.rows[first]} too', "warning"
            )
