"""A force batch for blind tests: tool, metal, sensor and settings drawn by a seed, any effects hidden.

What is cut does not depend on what is hidden: slots at several feeds, side cuts both ways, a slot across,
helical holes. The styles differ in how it is measured, so that what was made to work on one can be tried on
another.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from virtual_cell.chips import Tool
from virtual_cell.dynamometer import Dynamometer
from virtual_cell.hidden import EFFECTS, Parameters
from virtual_cell.milling import Coefficients, in_millimetres
from virtual_cell.session import Plan, Session, cut_all
from virtual_cell.units import DEG, MM, N_MM, N_MM2, RPM
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_yaml

_AXES = (
    {"x": "x", "y": "y", "z": "z"},
    {"x": "y", "y": "-x", "z": "z"},
    {"x": "-y", "y": "-x", "z": "-z"},
    {"x": "-x", "y": "y", "z": "-z"},
)
STYLES = ("a", "b")


@dataclass(frozen=True)
class Style:
    """How a batch is measured.

    ``rate`` Hz; ``noise`` N, from–to; ``air_s`` s in the air before each straight cut (None: none);
    ``tacho``; ``scatter`` relative, of the coefficients from run to run; ``feeds`` of the slots of the
    identification, in parts of the largest; ``speeds`` of the spindle, in parts of the nominal one, taken in
    turn by the conditions.
    """

    rate: float = 8192.0
    noise: tuple[float, float] = (0.7, 2.5)
    air_s: float | None = 0.1
    tacho: bool = False
    scatter: float = 0.01
    feeds: tuple[float, ...] = (0.25, 0.45, 0.7, 1.0)
    speeds: tuple[float, ...] = (1.0,)


def _drawn_style(name: str, seed: int) -> Style:
    """Style ``a`` is always the same; in ``b`` every batch is measured in its own way."""
    if name == "a":
        return Style()
    rng = np.random.default_rng([seed, 11])
    feeds = ((0.3, 0.55, 1.0), (0.25, 0.4, 0.65, 1.0), (0.2, 0.35, 0.5, 0.75, 1.0))
    return Style(
        rate=float(rng.choice([6000.0, 10000.0, 12800.0])),
        noise=(1.5, 4.0),
        air_s=None if rng.uniform() < 0.3 else 0.15,
        tacho=bool(rng.uniform() < 0.5),
        scatter=float(rng.choice([0.007, 0.013])),
        feeds=feeds[rng.integers(len(feeds))],
        speeds=(1.0, 0.75, 1.2),
    )


def make(folder: Path, effects: Mapping[str, Parameters | None], seed: int, style: str = "a") -> Row:
    """Write a batch that hides ``effects`` (name → parameters, or None: drawn by the seed); return the truth.

    Raises
    ------
    KeyError
        For an effect that is not known.
    """
    rng = np.random.default_rng([seed, 7])
    diameter, axes = float(rng.choice([10.0, 12.0, 16.0])), _AXES[rng.integers(len(_AXES))]
    measured = _drawn_style(style, seed)
    session, noise = _session(diameter, axes, measured, rng)
    plans = _plans(session, diameter, measured, rng)
    feeds = [plan.feed_per_tooth_mm for plan in plans[: len(measured.feeds)]]
    session = replace(
        session,
        depth=plans[0].axial_depth_mm * MM,
        mean_chip=float(np.mean(feeds)) * MM * 2.0 / math.pi,
        speed_reference=plans[0].spindle_rpm * RPM,
    )
    coefficients = _in_words(session.coefficients)
    truth = {name: given or EFFECTS[name].draw(rng, session) for name, given in effects.items()}
    for name, parameters in truth.items():
        session = EFFECTS[name].apply(session, parameters)
    fresh_folder(folder)
    rows = cut_all(session, plans, folder, rng)
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    write_yaml(folder / "cell.yaml", {"cell": "bench-mill"})
    write_yaml(folder / "batch.yaml", _manifest(folder.name, session, diameter, axes, noise))
    return {
        "batch": folder.name,
        "seed": seed,
        "style": style,
        "effects": truth,
        "coefficients": coefficients,
    }


def _in_words(metal: Coefficients) -> Row:
    """Return the coefficients of the metal as a manifest writes them: before any effect, and any scatter."""
    force = {name: value for name, value in asdict(metal).items() if name.startswith("k")}
    shear = {f"{name}_n_mm2": value / N_MM2 for name, value in force.items() if name.endswith("c")}
    return shear | {f"{name}_n_mm": value / N_MM for name, value in force.items() if name.endswith("e")}


def _session(
    diameter: float, axes: Mapping[str, str], style: Style, rng: np.random.Generator
) -> tuple[Session, float]:
    """Draw the tool (good, so far), the metal and the sensor."""
    teeth, helix = int(rng.choice([2, 3, 4])), float(rng.choice([30.0, 35.0, 40.0]))
    tool = Tool(diameter / 2.0 * MM, helix * DEG, np.arange(teeth) * (2.0 * math.pi / teeth))
    shear = np.array([850.0, 330.0, 190.0]) * np.exp(rng.normal(0.0, 0.15, 3)) * rng.choice([1.0, 1.6])
    edge = np.array([15.0, 18.0, 5.0]) * np.exp(rng.normal(0.0, 0.2, 3))
    metal = in_millimetres(shear.tolist(), edge.tolist(), (90.0, 4.0))
    noise = round(float(rng.uniform(*style.noise)), 2)
    rows = np.array([_direction(axes[axis]) for axis in "xyz"])
    sensor = Dynamometer(style.rate, str(rng.choice(["work", "tool"])), rows, noise)
    hole = 0.8 * diameter * MM
    return Session(tool, metal, sensor, hole, scatter=style.scatter, tacho=style.tacho), noise


def _direction(axis: str) -> list[float]:
    unit = [0.0, 0.0, 0.0]
    unit["xyz".index(axis[-1])] = -1.0 if axis.startswith("-") else 1.0
    return unit


def _plans(session: Session, diameter: float, style: Style, rng: np.random.Generator) -> tuple[Plan, ...]:
    """Return the conditions: the first are the slots of the identification."""
    rpm, depth = float(rng.choice([4000.0, 5000.0, 6000.0])), float(rng.choice([1.0, 1.5, 2.0]))
    top, arc = round(float(rng.uniform(0.1, 0.14)), 3), 2.0 * math.pi * 0.3 * diameter
    slot = Plan(
        *("slot", "identify", "slot", rpm, top, depth, diameter),
        cut_length_mm=120.0,
        full_s=0.4,
        air_s=style.air_s,
    )
    across = replace(slot, condition="across", feed_direction_deg=90.0)
    down = replace(
        slot, condition="down", operation="side", direction="down", radial_depth_mm=round(diameter * 0.35, 1)
    )
    up = replace(down, condition="up", direction="up")
    hole = replace(slot, condition="helical", operation="helical", cut_length_mm=round(3.0 * arc, 1))

    speeds = itertools.cycle(style.speeds)

    def at(plan: Plan, share: float, role: str = "identify") -> Plan:
        feed, speed = round(top * share, 3), rpm * next(speeds)
        orbit_s = arc / (feed * session.tool.teeth * speed / 60.0)
        full_s = round(1.03 * orbit_s, 3) if plan.operation == "helical" else plan.full_s
        named = replace(plan, condition=f"{plan.condition}-{feed:g}", role=role, feed_per_tooth_mm=feed)
        return replace(named, spindle_rpm=speed, full_s=full_s, replicates=3 if role == "identify" else 2)

    return (
        *(at(slot, share) for share in style.feeds),
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
                "rate_hz": sensor.rate,
                "reads": sensor.reads,
                "axes": dict(axes),
                "rotation_deg": 0,
                "range_n": sensor.capacity,
                "noise_n": noise,
            }
        },
    }
