"""A tool as ``batch.yaml`` declares it."""

from __future__ import annotations

import numpy as np

from metro.cutting.cutter import Cutter, evenly_pitched
from metro.units import DEG, JSON, MM


def cutter_of(tool: JSON) -> Cutter:
    """Return a tool of ``batch.yaml``, of which diameter and teeth are given, without runout."""
    pitch = tool.get("pitch_deg")
    angles = tuple(np.cumsum([0.0, *pitch[:-1]]) * DEG) if pitch else evenly_pitched(tool["teeth"])
    end, inserts = tool.get("end"), "cutting_edge_angle_deg" in tool
    return Cutter(
        radius=tool["diameter_mm"] * MM / 2,
        helix=tool.get("helix_deg", 0.0) * DEG,
        tooth_angles=tuple(float(angle) for angle in angles),
        corner=(0.5 * tool["diameter_mm"] if end == "ball" else tool.get("corner_radius_mm", 0.0)) * MM,
        taper=(90.0 - tool["cutting_edge_angle_deg"] if inserts else tool.get("taper_deg", 0.0)) * DEG,
    )
