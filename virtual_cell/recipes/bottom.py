"""trimule-bottom: holes hardly wider than the tool, so steep that K_Fac shows beside K_Fae; and slots.

In the published hole, ⌀19.05 mm, the bottom edges feed by less than half a micrometre per tooth: K_Fac is
0.3 % of their thrust there. In a hole of ⌀13 mm the orbit is a seventh as long, the feed larger by as much.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from virtual_cell.chips import Tool
from virtual_cell.dynamometer import Dynamometer
from virtual_cell.recipes.trimule import TITANIUM
from virtual_cell.session import Plan, Session, cut_all
from virtual_cell.units import DEG, MM
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_yaml

RATE, HOLE_MM = 2048.0, 13.0
_ARC_MM = math.pi * (HOLE_MM - 12.0)
_SLOT = Plan("slot", "identify", "slot", 2000.0, 0.0, 0.2, 12.0, cut_length_mm=40.0, full_s=0.5)


def _slot(role: str, feed: float) -> Plan:
    return replace(_SLOT, condition=f"slot-{feed:g}", role=role, feed_per_tooth_mm=feed, replicates=2)


def _hole(role: str, feed: float, replicates: int) -> Plan:
    """Holes at one feed; the record holds a little more than one orbit."""
    orbit_s = _ARC_MM / (feed * 4.0 * 2000.0 / 60.0)
    seconds = math.ceil(max(1.05 * orbit_s, 0.5) * 64.0) / 64.0
    plan = replace(_slot(role, feed), condition=f"hole-{feed:g}", operation="helical", axial_depth_mm=0.4)
    return replace(plan, replicates=replicates, full_s=seconds, cut_length_mm=round(6.0 * _ARC_MM, 1))


PLANS = (
    *(_slot("identify", feed) for feed in (0.03, 0.06)),
    _slot("validate", 0.045),
    *(_hole("identify", feed, 3) for feed in (0.02, 0.1)),
    _hole("validate", 0.06, 2),
)


def make(folder: Path) -> Row:
    """Write the batch; return the truth."""
    rng = np.random.default_rng(2604)
    tool = Tool(6.0 * MM, 40.0 * DEG, np.arange(4) * 90.0 * DEG)
    sensor = Dynamometer(RATE, "work", np.eye(3), noise=2.0, offset=2.0, step=0.1)
    fresh_folder(folder)
    rows = cut_all(Session(tool, TITANIUM, sensor, hole_radius=HOLE_MM * MM / 2.0), PLANS, folder, rng)
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    write_yaml(folder / "batch.yaml", _manifest(folder.name))
    return {"batch": folder.name, "effects": {}}


def _manifest(name: str) -> Row:
    return {
        "format": 1,
        "batch": name,
        "title": "Steep holes and slots in Ti6Al4V, for the coefficients of the bottom edges",
        "source": "simulated",
        "cell": "trimule",
        "tool": {"diameter_mm": 12, "teeth": 4, "helix_deg": 40, "pitch_deg": [90, 90, 90, 90]},
        "work": {"material": "Ti6Al4V", "size_mm": [120, 80, 12]},
        "hole_diameter_mm": HOLE_MM,
        "instruments": {
            "dynamometer": {"rate_hz": RATE, "reads": "work", "range_n": 5000, "noise_n": 2.0},
        },
    }
