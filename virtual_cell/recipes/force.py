"""A force batch for blind tests: tool, metal, sensor and settings drawn by a seed, any effects hidden.

What is cut does not depend on what is hidden: slots at four feeds, side cuts both ways, a slot across,
helical holes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from virtual_cell.chips import Tool
from virtual_cell.dynamometer import Dynamometer
from virtual_cell.hidden import EFFECTS, Parameters
from virtual_cell.milling import in_millimetres
from virtual_cell.session import Plan, Session, cut_all
from virtual_cell.units import DEG, MM
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_yaml

_AXES = (
    {"x": "x", "y": "y", "z": "z"},
    {"x": "y", "y": "-x", "z": "z"},
    {"x": "-y", "y": "-x", "z": "-z"},
    {"x": "-x", "y": "y", "z": "-z"},
)
_RATE = 8192.0


def make(folder: Path, effects: Mapping[str, Parameters | None], seed: int) -> Row:
    """Write a batch that hides ``effects`` (name → parameters, or None: drawn by the seed); return the truth.

    Raises
    ------
    KeyError
        For an effect that is not known.
    """
    rng = np.random.default_rng([seed, 7])
    diameter, axes = float(rng.choice([10.0, 12.0, 16.0])), _AXES[rng.integers(len(_AXES))]
    session, noise = _session(diameter, axes, rng)
    plans = _plans(session, diameter, rng)
    mean_chip = float(np.mean([plan.feed_per_tooth_mm for plan in plans[:4]])) * MM * 2.0 / math.pi
    session = replace(session, depth=plans[0].axial_depth_mm * MM, mean_chip=mean_chip)
    truth = {name: given or EFFECTS[name].draw(rng, session) for name, given in effects.items()}
    for name, parameters in truth.items():
        session = EFFECTS[name].apply(session, parameters)
    fresh_folder(folder)
    rows = cut_all(session, plans, folder, rng)
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    write_yaml(folder / "cell.yaml", {"cell": "bench-mill"})
    write_yaml(folder / "batch.yaml", _manifest(folder.name, session, diameter, axes, noise))
    return {"batch": folder.name, "seed": seed, "effects": truth}


def _session(diameter: float, axes: Mapping[str, str], rng: np.random.Generator) -> tuple[Session, float]:
    """Draw the tool (good, so far), the metal and the sensor."""
    teeth, helix = int(rng.choice([2, 3, 4])), float(rng.choice([30.0, 35.0, 40.0]))
    tool = Tool(diameter / 2.0 * MM, helix * DEG, np.arange(teeth) * (2.0 * math.pi / teeth))
    shear = np.array([850.0, 330.0, 190.0]) * np.exp(rng.normal(0.0, 0.15, 3)) * rng.choice([1.0, 1.6])
    edge = np.array([15.0, 18.0, 5.0]) * np.exp(rng.normal(0.0, 0.2, 3))
    metal = in_millimetres(shear.tolist(), edge.tolist(), (90.0, 4.0))
    noise = round(float(rng.uniform(0.7, 2.5)), 2)
    rows = np.array([_direction(axes[axis]) for axis in "xyz"])
    sensor = Dynamometer(_RATE, str(rng.choice(["work", "tool"])), rows, noise)
    return Session(tool, metal, sensor, hole_radius=0.8 * diameter * MM), noise


def _direction(axis: str) -> list[float]:
    unit = [0.0, 0.0, 0.0]
    unit["xyz".index(axis[-1])] = -1.0 if axis.startswith("-") else 1.0
    return unit


def _plans(session: Session, diameter: float, rng: np.random.Generator) -> tuple[Plan, ...]:
    """Return the conditions: the first four are the slots of the identification."""
    rpm, depth = float(rng.choice([4000.0, 5000.0, 6000.0])), float(rng.choice([1.0, 1.5, 2.0]))
    top, arc = round(float(rng.uniform(0.1, 0.14)), 3), 2.0 * math.pi * 0.3 * diameter
    slot = Plan(
        "slot", "identify", "slot", rpm, top, depth, diameter, cut_length_mm=120.0, full_s=0.4, air_s=0.1
    )
    across = replace(slot, condition="across", feed_direction_deg=90.0)
    down = replace(
        slot, condition="down", operation="side", direction="down", radial_depth_mm=round(diameter * 0.35, 1)
    )
    up = replace(down, condition="up", direction="up")
    hole = replace(slot, condition="helical", operation="helical", cut_length_mm=round(3.0 * arc, 1))

    def at(plan: Plan, share: float, role: str = "identify") -> Plan:
        feed = round(top * share, 3)
        orbit_s = arc / (feed * session.tool.teeth * rpm / 60.0)
        full_s = round(1.03 * orbit_s, 3) if plan.operation == "helical" else plan.full_s
        named = replace(plan, condition=f"{plan.condition}-{feed:g}", role=role, feed_per_tooth_mm=feed)
        return replace(named, full_s=full_s, replicates=3 if role == "identify" else 2)

    return (
        *(at(slot, share) for share in (0.25, 0.45, 0.7, 1.0)),
        at(down, 0.7),
        at(hole, 1.0),
        at(slot, 0.85, "validate"),
        at(up, 0.7, "validate"),
        at(across, 0.45, "validate"),
        at(hole, 0.7, "validate"),
    )


def _manifest(name: str, session: Session, diameter: float, axes: Mapping[str, str], noise: float) -> Row:
    teeth, sensor = session.tool.teeth, session.dynamometer
    return {
        "format": 1,
        "batch": name,
        "title": f"Milling tests, {teeth}-tooth {diameter:g} mm end mill",
        "source": "simulated",
        "cell": "bench-mill",
        "tool": {
            "diameter_mm": diameter,
            "teeth": teeth,
            "helix_deg": round(session.tool.helix / DEG, 6),
            "pitch_deg": [360.0 / teeth] * teeth,
        },
        "work": {"material": "AA6061-T6", "size_mm": [200, 150, 40]},
        "hole_diameter_mm": 2.0 * session.hole_radius / MM,
        "instruments": {
            "dynamometer": {
                "rate_hz": _RATE,
                "reads": sensor.reads,
                "axes": dict(axes),
                "rotation_deg": 0,
                "range_n": sensor.capacity,
                "noise_n": noise,
            }
        },
    }
