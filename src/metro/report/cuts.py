"""Settings of a cut: their columns in the table of runs, their names, and how deep a tool may cut."""

from __future__ import annotations

import math
from typing import NamedTuple

import pandas as pd

from metro.units import JSON


class Setting(NamedTuple):
    """A numeric setting: its name, its unit, and the words after its value as a property of the cut."""

    name: str
    unit: str
    of_cut: str

    @property
    def title(self) -> str:
        """Name and unit, as the head of a column."""
        return f"{self.name} ({self.unit})"


NUMBERS = {
    "feed_per_tooth_mm": Setting("feed per tooth", "mm", "mm per tooth"),
    "axial_depth_mm": Setting("axial depth", "mm", "mm deep"),
    "radial_depth_mm": Setting("radial depth", "mm", "mm wide"),
    "spindle_rpm": Setting("spindle speed", "rpm", "rpm"),
}
NAMES = ("operation", "direction", "wrist", "location", "orientation", "pose")
FLUTES = 4.0  # diameters of the tool, the length of long cutting edges: nobody cuts deeper


def deepest_cut(manifest: JSON) -> float:
    """Return the depth of cut, mm, beyond which a boundary is of no use; infinite where no tool is known."""
    diameter = (manifest.get("tool") or {}).get("diameter_mm")
    return FLUTES * float(diameter) if diameter else math.inf


def not_drawn(depth: pd.Series, deepest: float) -> str:
    """Say from which depth on a boundary is not drawn; empty where all of it may be."""
    if not float(depth.max()) > deepest:
        return ""
    return f" Depths beyond {deepest:g} mm, {FLUTES:g} diameters of the tool, are not shown."
