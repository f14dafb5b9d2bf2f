"""Why nothing is known of an arm."""

from __future__ import annotations

from metro.batch.entries import UNKNOWN
from metro.units import JSON


def no_arm(cell: JSON) -> str:
    """Say why there is no arm where a cell has none."""
    name = cell.get("cell")
    if name == UNKNOWN:
        return "no machine is named, and no arm is described (arm.dh in cell.yaml)"
    return f"cell {name}: no arm.dh, nothing is known of the arm"
