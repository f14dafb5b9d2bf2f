"""trimule-helical: helical milling of Ti6Al4V, published tool, coefficients and modes; the tool runs out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from virtual_cell.chips import Tool
from virtual_cell.dynamometer import Dynamometer
from virtual_cell.hammer import hit
from virtual_cell.lobes import stable
from virtual_cell.milling import in_millimetres
from virtual_cell.modes import Modes
from virtual_cell.recipes.trimule_structure import FILES, write_modal_tests, write_stations
from virtual_cell.session import Plan, Session, cut_all
from virtual_cell.units import DEG, MM, UM
from virtual_cell.write import (
    RUN_COLUMNS,
    Row,
    fresh_folder,
    impact_row,
    write_csv,
    write_signal,
    write_yaml,
)

TITANIUM = in_millimetres((10145.0, 11036.5, 5000.0), (591.92, 100.03, 214.32), (243.47, 33.072))
HOLE_MM = 19.05
RUNOUT_UM, RUNOUT_DEG = 8.2, 37.0
# table 6, position 1: damped frequency (Hz), damping (%), stiffness (N/m); z lies in the plane of cutting
_TABLE_6 = {
    "x": (
        (21.3257, 6.08951, 7.25548e6),
        (34.6937, 7.07726, 4.05902e6),
        (56.6075, 3.5692, 4.18385e6),
        (65.5141, 6.33944, 2.21663e6),
    ),
    "z": (
        (31.4277, 6.71896, 3.1541e8),
        (35.0952, 4.76042, 7.06418e7),
        (54.7344, 4.99933, 4.71786e7),
        (67.2582, 3.79608, 1.46188e7),
    ),
}
MODES = {
    direction: Modes(
        *(np.array(column) for column in zip(*((f, zeta / 100.0, k) for f, zeta, k in rows), strict=True))
    )
    for direction, rows in _TABLE_6.items()
}
_CHATTER_FEED_MM = 0.02
_CHATTER_RPM = (1000.0, 1250.0, 1500.0, 1750.0, 2000.0, 2250.0, 2500.0)
_CHATTER_DEPTHS_MM = (0.01, 0.02, 0.03, 0.04, 0.06, 0.08, 0.1, 0.12, 0.15, 0.2)
_SLOT = Plan("slot", "identify", "slot", 2000.0, 0.0, 0.2, 12.0, cut_length_mm=40.0, full_s=0.75)


def _slot(role: str, feed: float, replicates: int) -> Plan:
    return replace(
        _SLOT, condition=f"slot-{feed:g}", role=role, feed_per_tooth_mm=feed, replicates=replicates
    )


def _helical(role: str, feed: float) -> Plan:
    """Two holes at one feed; the record holds a little more than one orbit."""
    arc = math.pi * (HOLE_MM - 12.0)
    orbit_s = arc / (feed * 4.0 * 2000.0 / 60.0)
    hole = replace(_slot(role, feed, 2), condition=f"helical-{feed:g}", operation="helical")
    return replace(hole, full_s=math.ceil(orbit_s * 1.05 * 64.0) / 64.0, cut_length_mm=round(6.0 * arc, 1))


PLANS = (
    *(_slot("identify", feed, 3) for feed in (0.02, 0.03, 0.04, 0.05)),
    _slot("validate", 0.06, 2),
    _helical("identify", 0.03),
    _helical("identify", 0.05),
    _helical("validate", 0.04),
)


def make(folder: Path) -> Row:
    """Write the batch; return the truth."""
    rng = np.random.default_rng(2602)
    tool = Tool(6.0 * MM, 40.0 * DEG, np.arange(4) * 90.0 * DEG, RUNOUT_UM * UM, RUNOUT_DEG * DEG)
    axes = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    sensor = Dynamometer(8192.0, "work", axes, noise=2.0, offset=2.0, step=0.1)
    session = Session(tool, TITANIUM, sensor, hole_radius=HOLE_MM * MM / 2.0)
    fresh_folder(folder)
    rows = cut_all(session, PLANS, folder, rng)
    for row in rows:
        row["pose"] = ""  # of a rigid tool, between the stations: work_in_base says where
    rows += _chatter_tests(len(rows))
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    write_modal_tests(folder, MODES, np.random.default_rng(2603))
    write_yaml(folder / "cell.yaml", {"cell": "trimule", "stations": "stations.csv"})
    write_stations(folder, np.random.default_rng(2604))
    write_yaml(folder / "batch.yaml", _manifest(folder.name))
    return {
        "batch": folder.name,
        "effects": {"tool_runout": {"radius_um": RUNOUT_UM, "angle_deg": RUNOUT_DEG}},
    }


def _chatter_tests(before: int) -> list[Row]:
    """Holes at rising depth per orbit, speed by speed, until there is chatter; nothing is recorded."""
    radius = (HOLE_MM - 12.0) / 2.0
    turns = round(2.0 * np.pi * radius / (4.0 * _CHATTER_FEED_MM))
    rpm, depth = (a.ravel() for a in np.meshgrid(_CHATTER_RPM, _CHATTER_DEPTHS_MM, indexing="ij"))
    modes = (MODES["x"], MODES["z"])
    quiet = stable(
        modes,
        TITANIUM,
        teeth=4,
        feed=_CHATTER_FEED_MM * MM,
        rpm=rpm,
        depth=depth * MM,
        turns=turns,
        orbit=2.0 * np.pi,
    )
    rows: list[Row] = []
    for speed in _CHATTER_RPM:
        for a, good in zip(depth[rpm == speed].tolist(), quiet[rpm == speed].tolist(), strict=True):
            place = before + len(rows) + 1
            rows.append(
                {
                    "run": f"c{place - before:02d}",
                    "role": "validate",
                    "condition": f"chatter-{speed:g}-{a:g}",
                    "replicate": 1,
                    "order": place,
                    "operation": "helical",
                    "spindle_rpm": speed,
                    "feed_per_tooth_mm": _CHATTER_FEED_MM,
                    "axial_depth_mm": a,
                    "radial_depth_mm": 12.0,
                    "direction": "slot",
                    "orbit_rpm": round(speed / turns, 4),
                    "pose": "1",
                    "cut_length_mm": round(2.0 * np.pi * radius, 1),
                    "stable": "yes" if good else "no",
                }
            )
            if not good:
                break
    return rows


def impacts(
    folder: Path, rng: np.random.Generator, modes: Mapping[str, Modes] = MODES, hits: int = 5
) -> list[Row]:
    """Write some hits on the tip in each direction; return their rows."""
    rows: list[Row] = []
    for direction, along in modes.items():
        for replicate in range(1, hits + 1):
            file = f"impacts/1{direction}-{replicate}.parquet"
            write_signal(folder / file, hit(along, 2048.0, 2.0, rng))
            rows.append(impact_row(f"1{direction}", file, "record", "m/s2", replicate))
    return rows


def _manifest(name: str) -> Row:
    return {
        "format": 1,
        "batch": name,
        "title": "Helical milling of Ti6Al4V with a five-axis hybrid robot, four-tooth 12 mm end mill",
        "source": "simulated",
        "cell": "trimule",
        "tool": {"diameter_mm": 12, "teeth": 4, "helix_deg": 40, "pitch_deg": [90, 90, 90, 90]},
        "work": {"material": "Ti6Al4V", "size_mm": [120, 80, 12]},
        "work_in_base": {"xyz_mm": [-260, 0, -340], "rpy_deg": [90, 0, 0]},  # the tool points along base y
        "hole_diameter_mm": HOLE_MM,
        "instruments": {
            "dynamometer": {
                "rate_hz": 8192,
                "reads": "work",
                "axes": {"x": "y", "y": "-x", "z": "z"},
                "rotation_deg": 0,
                "range_n": 5000,
                "noise_n": 2.0,
            },
            "hammer": {"rate_hz": 2048, "window": "none"},
        },
        "files": FILES,
    }
