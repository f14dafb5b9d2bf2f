"""Settings of a cut: their columns in the table of runs, and their names."""

from __future__ import annotations

from typing import NamedTuple


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
