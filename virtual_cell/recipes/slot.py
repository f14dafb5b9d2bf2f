"""clean-slot: slots and side cuts in aluminium on a rigid machine with a good tool; nothing is hidden."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from virtual_cell.chips import Tool
from virtual_cell.dynamometer import Dynamometer
from virtual_cell.milling import in_millimetres
from virtual_cell.session import Plan, Session, cut_all
from virtual_cell.units import DEG, MM
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_yaml

ALUMINIUM = in_millimetres((842.0, 317.0, 176.0), (14.2, 17.8, 3.9))
_SLOT = Plan("slot", "identify", "slot", 6000.0, 0.0, 2.0, 12.0, air_s=0.12)
_DOWN = replace(_SLOT, condition="down", operation="side", direction="down", radial_depth_mm=4.0)
_UP = replace(_DOWN, condition="up", direction="up")


def _at(plan: Plan, feed: float, replicates: int, role: str = "identify") -> Plan:
    name = f"{plan.condition}-{feed:g}"
    return replace(plan, condition=name, role=role, feed_per_tooth_mm=feed, replicates=replicates)


PLANS = (
    *(_at(_SLOT, feed, 3) for feed in (0.04, 0.06, 0.09, 0.13)),
    *(_at(_DOWN, feed, 2) for feed in (0.06, 0.12)),
    _at(_SLOT, 0.11, 2, "validate"),
    _at(_DOWN, 0.09, 2, "validate"),
    _at(_UP, 0.09, 2, "validate"),
)


def make(folder: Path) -> Row:
    """Write the batch; return the truth."""
    rng = np.random.default_rng(2601)
    tool = Tool(6.0 * MM, 30.0 * DEG, np.arange(3) * 120.0 * DEG)
    sensor = Dynamometer(10000.0, "work", np.eye(3), noise=1.0)
    fresh_folder(folder)
    rows = cut_all(Session(tool, ALUMINIUM, sensor), PLANS, folder, rng)
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    write_yaml(folder / "cell.yaml", {"cell": "bench-mill"})
    write_yaml(
        folder / "batch.yaml",
        {
            "format": 1,
            "batch": folder.name,
            "title": "Slot and side milling of AA6061-T6 on a bench mill, three-tooth 12 mm end mill",
            "source": "simulated",
            "cell": "bench-mill",
            "tool": {"diameter_mm": 12, "teeth": 3, "helix_deg": 30, "pitch_deg": [120, 120, 120]},
            "work": {"material": "AA6061-T6", "size_mm": [150, 100, 30]},
            "instruments": {
                "dynamometer": {
                    "rate_hz": 10000,
                    "reads": "work",
                    "axes": {"x": "x", "y": "y", "z": "z"},
                    "rotation_deg": 0,
                    "range_n": 5000,
                    "noise_n": 1.0,
                }
            },
        },
    )
    return {"batch": folder.name, "effects": {}}
