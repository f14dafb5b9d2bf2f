"""A force batch for blind tests: tool, metal, sensor and settings drawn by a seed, any effects hidden.

What is cut does not depend on what is hidden: slots at several feeds, side cuts both ways, a slot across,
helical holes. The styles differ in how it is measured, so that what was made to work on one can be tried on
another. Runs can be cut after those of a batch, by the same tool in the same metal: :func:`cut_more`.
"""

from __future__ import annotations

import csv
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from virtual_cell.chips import Tool
from virtual_cell.dynamometer import Dynamometer
from virtual_cell.hidden import EFFECTS, Parameters
from virtual_cell.milling import Coefficients, in_millimetres
from virtual_cell.session import Plan, Session, cut_all, cut_in_order, orbit_rpm
from virtual_cell.units import DEG, MM, N_MM, N_MM2, RPM
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_yaml

_AXES = (
    {"x": "x", "y": "y", "z": "z"},
    {"x": "y", "y": "-x", "z": "z"},
    {"x": "-y", "y": "-x", "z": "-z"},
    {"x": "-x", "y": "y", "z": "-z"},
)
STYLES = ("a", "b", "c", "d")
FEW = "few"  # a style beside these: too few runs to distinguish small effects
FULL_S, CUT_MM = 0.4, 120.0  # length of a straight cut as recorded, and as made
AIR_S = 0.1  # of a record before the cut begins


@dataclass(frozen=True)
class Style:
    """How a batch is measured.

    ``rate`` Hz; ``noise`` N, from–to; ``air_s`` s in the air before each straight cut (None: none);
    ``tacho``; ``scatter`` relative, of the coefficients from run to run; ``feeds`` of the slots of the
    identification, in parts of the largest; ``speeds`` of the spindle, in parts of the nominal one, taken in
    turn by the conditions; ``replicates`` of those of the identification; ``narrow``: nothing is cut but
    strips of a tenth of the diameter and half the depth, along which most effects are confounded.
    """

    rate: float = 8192.0
    noise: tuple[float, float] = (0.7, 2.5)
    air_s: float | None = AIR_S
    tacho: bool = False
    scatter: float = 0.01
    feeds: tuple[float, ...] = (0.25, 0.45, 0.7, 1.0)
    speeds: tuple[float, ...] = (1.0,)
    replicates: int = 3
    narrow: bool = False


def _drawn_style(name: str, seed: int) -> Style:
    """Style ``a`` is always the same; ``b`` differs from batch to batch; ``few`` has the fewest runs."""
    if name == "a":
        return Style()
    rng = np.random.default_rng([seed, 11])
    if name == FEW:
        close = ((0.85, 0.9, 1.0), (0.8, 0.95, 1.0), (0.9, 0.95, 1.0))
        return Style(feeds=close[rng.integers(len(close))], replicates=1, narrow=True)
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


@dataclass(frozen=True)
class _Drawn:
    """What a seed draws: truth, plan, the metal without any effect, and what the manifest declares."""

    session: Session
    plans: tuple[Plan, ...]
    effects: Mapping[str, Parameters]
    coefficients: Row
    manifest: Row
    rng: np.random.Generator


def make(folder: Path, effects: Mapping[str, Parameters | None], seed: int, style: str = "a") -> Row:
    """Write a batch that hides ``effects`` (name → parameters, or None: drawn by the seed); return the truth.

    Raises
    ------
    KeyError
        For an effect that is not known.
    """
    drawn = _drawn(effects, seed, style)
    fresh_folder(folder)
    rows = cut_all(drawn.session, drawn.plans, folder, drawn.rng)
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    write_yaml(folder / "cell.yaml", {"cell": "bench-mill"})
    write_yaml(folder / "batch.yaml", {"format": 1, "batch": folder.name, **drawn.manifest})
    return {
        "batch": folder.name,
        "seed": seed,
        "style": style,
        "effects": dict(drawn.effects),
        "coefficients": drawn.coefficients,
    }


def cut_more(
    folder: Path, planned: Sequence[Row], effects: Mapping[str, Parameters], seed: int, style: str
) -> None:
    """Cut planned runs after those of a batch, in their order, as the same truth has it; add their rows.

    Each record begins in the air, as is asked for.

    Parameters
    ----------
    planned : rows of a run table without files, numbers as numbers. effects, seed, style : of the batch.
    """
    drawn = _drawn(effects, seed, style)
    with (folder / "runs.csv").open(newline="", encoding="utf-8") as stream:
        cut: list[Row] = list(csv.DictReader(stream))
    order = [(_planned(row, drawn.session), int(row["replicate"])) for row in planned]
    rng = np.random.default_rng([seed, 17])
    metres = sum(float(row["cut_length_mm"]) * MM for row in cut)
    more = cut_in_order(drawn.session, order, folder, rng, after=len(cut), metres=metres)
    named = [made | {"run": row["run"]} for made, row in zip(more, planned, strict=True)]
    write_csv(folder / "runs.csv", [*cut, *named], RUN_COLUMNS)


def _planned(row: Row, session: Session) -> Plan:
    """Return how a row of a run table is cut: a record as long as that of others of its length."""
    plan = Plan(
        **{name: row[name] for name in Plan.__dataclass_fields__ if name in row and row[name] is not None}
    )
    if plan.operation == "helical":
        orbit_s = 60.0 / orbit_rpm(session, plan)
        return replace(plan, full_s=round(1.03 * orbit_s, 3), replicates=1)
    return replace(plan, air_s=AIR_S, full_s=FULL_S * plan.cut_length_mm / CUT_MM, replicates=1)


def _drawn(effects: Mapping[str, Parameters | None], seed: int, style: str) -> _Drawn:
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
    return _Drawn(session, plans, truth, coefficients, _manifest(session, diameter, axes, noise), rng)


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
        cut_length_mm=CUT_MM,
        full_s=FULL_S,
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
        replicates = style.replicates if role == "identify" else min(2, style.replicates)
        return replace(named, spindle_rpm=speed, full_s=full_s, replicates=replicates)

    others = () if style.narrow else ((down, 0.7), (hole, 1.0))
    held_out = () if style.narrow else ((up, 0.7), (across, 0.45), (hole, 0.7))
    if style.narrow:
        slot = replace(down, radial_depth_mm=0.1 * diameter, axial_depth_mm=0.5 * depth)
    return (
        *(at(slot, share) for share in style.feeds),
        *(at(plan, share) for plan, share in others),
        at(slot, 0.925 if style.narrow else 0.85, "validate"),
        *(at(plan, share, "validate") for plan, share in held_out),
    )


def _manifest(session: Session, diameter: float, axes: Mapping[str, str], noise: float) -> Row:
    teeth, sensor = session.tool.teeth, session.dynamometer
    return {
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
