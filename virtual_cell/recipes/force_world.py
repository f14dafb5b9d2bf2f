"""A force batch in the harder world: all that real cells do is on, and any effects are hidden in it.

Style ``c`` is for tuning, ``d`` for judging: other feeds, speeds, depths, numbers of repeats, rates and
orders of cutting, so that what was made to work on one is tried on another programme, not on another seed.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from virtual_cell.hidden import Parameters, drawn_size
from virtual_cell.session import Plan, row_of, write_force
from virtual_cell.units import DEG, MM, N_MM, N_MM2
from virtual_cell.world.force.amplifier import drawn_amplifier
from virtual_cell.world.force.cell import Cell, cut_run, metres_of
from virtual_cell.world.force.cutter import drawn_tool, drawn_wear
from virtual_cell.world.force.effects import INSIDE
from virtual_cell.world.force.making import Making
from virtual_cell.world.force.metal import drawn_metal
from virtual_cell.world.force.outside import OUTSIDE
from virtual_cell.world.force.outside_work import Spots
from virtual_cell.world.force.people import SHORT, drawn_habits, order
from virtual_cell.world.force.pickup import drawn_pickup
from virtual_cell.world.force.spindle import drawn_spindle
from virtual_cell.world.force.table import drawn_table
from virtual_cell.world.force.terms import in_contract_terms
from virtual_cell.world.force.words import in_words
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_yaml

STYLES = ("c", "d")
HARDER = {**INSIDE, **OUTSIDE}
_DIRECTIONS = (
    {"x": "x", "y": "y", "z": "z"},
    {"x": "-y", "y": "x", "z": "z"},
    {"x": "y", "y": "x", "z": "-z"},
    {"x": "x", "y": "-y", "z": "-z"},
)


@dataclass(frozen=True)
class Programme:
    """What is cut and how it is recorded.

    Attributes
    ----------
    rate : Hz. white : noise of the sensor, N. feeds : of the slots, in parts of the largest. speeds : in
        parts of the nominal one, taken in turn. shallow : depth of a further slot in parts of the usual one.
        width : of side cuts in parts of the diameter. replicates, held : of identification and held-out
            conditions.
    clumped : probability that repeats come in clumps. tacho : whether the spindle's angle is recorded. short
        : probability that a condition is cut short, and recorded whole. air_s : air before each cut.
    """

    rate: float
    white: float
    feeds: tuple[float, ...]
    speeds: tuple[float, ...]
    shallow: float
    width: float
    replicates: int
    held: int
    clumped: float
    tacho: bool
    short: float
    air_s: float


def drawn_programme(style: str, rng: np.random.Generator) -> Programme:
    """Draw the programme of a batch of a style."""
    if style == "c":
        return Programme(
            rate=float(rng.choice([6000.0, 9600.0])),
            white=drawn_size(rng, 0.8, 3.0),
            feeds=((0.25, 0.45, 0.7, 1.0), (0.3, 0.6, 1.0), (0.2, 0.4, 0.65, 1.0))[rng.integers(3)],
            speeds=((1.0, 0.8), (1.0, 1.2, 0.85))[rng.integers(2)],
            shallow=0.5,
            width=0.35,
            replicates=3,
            held=2,
            clumped=0.4,
            tacho=bool(rng.uniform() < 0.3),
            short=0.2,
            air_s=0.15,
        )
    count = int(rng.integers(3, 6))
    least = float(rng.uniform(0.18, 0.35))
    return Programme(
        rate=float(rng.choice([5000.0, 6400.0, 9000.0, 10000.0])),
        white=drawn_size(rng, 0.6, 4.5),
        feeds=tuple(np.round(np.geomspace(least, 1.0, count), 2).tolist()),
        speeds=(1.0, *np.round(rng.uniform(0.7, 1.25, int(rng.integers(1, 3))), 2).tolist()),
        shallow=round(float(rng.uniform(0.4, 0.7)), 2),
        width=round(float(rng.uniform(0.2, 0.6)), 2),
        replicates=int(rng.integers(2, 5)),
        held=int(rng.integers(1, 4)),
        clumped=0.6,
        tacho=bool(rng.uniform() < 0.5),
        short=0.35,
        air_s=round(float(rng.uniform(0.08, 0.3)), 2),
    )


def make(folder: Path, effects: Mapping[str, Parameters | None], seed: int, style: str) -> Row:
    """Write a batch that hides ``effects`` (name → parameters, or None: drawn by the seed); return the truth.

    The truth has, beside what is hidden on purpose, what there is ``always_on`` of the contract's effects,
    how far its terms are from what was built (``translation_error``, relative), and the ``world`` that was
    drawn.

    Raises
    ------
    KeyError
        For an effect that is not known.
    """
    making, manifest = _drawn(seed, style, holes="orbit_stiffness" in effects)
    for name, given in effects.items():
        hidden = HARDER[name]
        parameters = given or hidden.draw(making.rng, making)
        making = hidden.apply(making, parameters)
        if name in OUTSIDE:
            manifest["hidden"][name] = parameters
    cell, plans = making.cell, making.plans
    outside = manifest.pop("hidden")
    fresh_folder(folder)
    write_csv(folder / "runs.csv", _cut(cell, plans, folder, making.rng), RUN_COLUMNS)
    write_yaml(folder / "cell.yaml", {"cell": "bench-mill"})
    write_yaml(folder / "batch.yaml", {"format": 1, "batch": folder.name, **manifest})
    terms = {name: term for name, term in in_contract_terms(cell, plans).items() if term.present}
    return {
        "batch": folder.name,
        "seed": seed,
        "style": style,
        "effects": {name: outside.get(name) or terms[name].parameters for name in effects},
        "translation_error": {name: round(terms[name].error, 4) for name in effects if name in terms},
        "always_on": {name: term.parameters for name, term in terms.items() if name not in effects},
        "coefficients": _coefficients(cell),
        "world": in_words(cell),
    }


def _drawn(seed: int, style: str, *, holes: bool) -> tuple[Making, Row]:
    """Draw a cell with nothing hidden, its plans, and what the manifest declares.

    ``holes``: whether helical holes have to be among the plans; else three of ten sessions have some.
    """
    rng = np.random.default_rng([seed, 23, STYLES.index(style)])
    programme = drawn_programme(style, rng)
    diameter, teeth = float(rng.choice([10.0, 12.0, 16.0])), int(rng.choice([2, 3, 4]))
    helix = float(rng.choice([30.0, 35.0, 40.0]))
    axes = _DIRECTIONS[rng.integers(len(_DIRECTIONS))]
    tool = drawn_tool(diameter * MM, teeth, helix * DEG, rng)
    hole = 0.5 * round(diameter * float(rng.uniform(1.45, 1.75)), 1)
    with_holes = bool(rng.uniform() < 0.3) or holes
    drawn = _plans(programme, diameter, teeth, hole, rng)
    plans = tuple(plan for plan in drawn if with_holes or plan.operation != "helical")
    feeds = [plan.feed_per_tooth_mm for plan in plans[: len(programme.feeds)]]
    metal = replace(drawn_metal(rng), reference=float(np.mean(feeds)) * MM * 2.0 / math.pi)
    metres, white = metres_of(plans), programme.white
    cell = Cell(
        tool,
        metal,
        drawn_wear(drawn_size(rng, 0.01, 0.06) / metres, metres, metal.edge, rng),
        drawn_spindle(rng),
        drawn_table(rng),
        drawn_amplifier(programme.rate, rng),
        drawn_pickup(white, rng),
        drawn_habits(rng, clumped=programme.clumped),
        np.array([_unit(axes[axis]) for axis in "xyz"]),
        str(rng.choice(["work", "tool"])),
        hole * MM,
        programme.tacho,
        metres=metres,
        depth=plans[0].axial_depth_mm * MM,
        causes=(
            Spots(drawn_size(rng, 3.0, 30.0), drawn_size(rng, 0.02, 0.2), drawn_size(rng, 0.2, 1.5) * MM),
        ),
    )
    declared = float(f"{white * math.exp(0.1 * rng.standard_normal()):.2g}")
    return Making(cell, plans, rng), _manifest(cell, diameter, helix, axes, declared)


def _unit(axis: str) -> list[float]:
    unit = [0.0, 0.0, 0.0]
    unit["xyz".index(axis[-1])] = -1.0 if axis.startswith("-") else 1.0
    return unit


def _plans(
    programme: Programme, diameter: float, teeth: int, hole: float, rng: np.random.Generator
) -> tuple[Plan, ...]:
    """Return the conditions; the first are the slots of the identification."""
    rpm, depth = float(rng.choice([3800.0, 4800.0, 5800.0])), float(rng.choice([1.0, 1.4, 1.8]))
    top = round(float(rng.uniform(0.09, 0.15)), 3)
    arc = 2.0 * math.pi * (hole - 0.5 * diameter)
    slot = Plan("slot", "identify", "slot", rpm, top, depth, diameter, full_s=0.45, air_s=programme.air_s)
    across = replace(slot, condition="across", feed_direction_deg=90.0)
    side = replace(slot, operation="side", radial_depth_mm=round(diameter * programme.width, 1))
    down, up = (replace(side, condition=way, direction=way) for way in ("down", "up"))
    if programme.clumped > 0.5 and rng.uniform() < 0.5:
        down, up = up, down
    shallow = replace(slot, condition="shallow", axial_depth_mm=round(depth * programme.shallow, 2))
    hole_cut = replace(slot, condition="helical", operation="helical", cut_length_mm=round(3.0 * arc, 1))
    speeds = itertools.cycle(programme.speeds)

    def at(plan: Plan, share: float, role: str = "identify") -> Plan:
        feed, speed = round(top * share, 3), round(rpm * next(speeds))
        advance = feed * teeth * speed / 60.0
        replicates = programme.replicates if role == "identify" else programme.held
        named = replace(
            plan,
            condition=f"{plan.condition}-{feed:g}",
            role=role,
            feed_per_tooth_mm=feed,
            spindle_rpm=float(speed),
            replicates=replicates,
        )
        if plan.operation == "helical":
            return replace(named, full_s=round(1.03 * arc / advance, 3))
        whole = min(SHORT / MM, 1.4 * advance)
        if rng.uniform() < programme.short and whole > 1.2 * diameter:
            return replace(named, cut_length_mm=round(whole, 1))
        return replace(named, cut_length_mm=float(round(rng.uniform(90.0, 140.0))))

    return (
        *(at(slot, share) for share in programme.feeds),
        at(shallow, 0.8),
        at(down, 0.7),
        at(hole_cut, 1.0),
        at(slot, 0.85, "validate"),
        at(up, 0.75, "validate"),
        at(across, 0.5, "validate"),
        at(hole_cut, 0.7, "validate"),
    )


def _cut(cell: Cell, plans: Sequence[Plan], folder: Path, rng: np.random.Generator) -> list[Row]:
    """Cut and record all runs into ``folder``; return the rows of the run table."""
    rows: list[Row] = []
    metres, planned = 0.0, order(plans, cell.habits, rng)
    for place, (plan, replicate) in enumerate(planned, start=1):
        name = f"r{place:02d}"
        made = cut_run(cell, plan, (place - 1) / len(planned), metres, rng)
        file = write_force(folder, name, made.time, made.read, made.angle if cell.tacho else None)
        rows.append(row_of(cell, plan, name, place, replicate) | {"dynamometer": file})
        metres += plan.cut_length_mm * MM
    return rows


def _coefficients(cell: Cell) -> Row:
    """Return the coefficients of the metal as a manifest writes them, before drift and scatter."""
    letters = "tra"
    shear = {f"k{one}c_n_mm2": float(k) / N_MM2 for one, k in zip(letters, cell.metal.shear, strict=True)}
    return shear | {f"k{one}e_n_mm": float(k) / N_MM for one, k in zip(letters, cell.metal.edge, strict=True)}


def _manifest(cell: Cell, diameter: float, helix: float, axes: Mapping[str, str], noise: float) -> Row:
    teeth = cell.tool.teeth
    return {
        "title": f"Milling tests, {teeth}-tooth {diameter:g} mm end mill",
        "source": "simulated",
        "cell": "bench-mill",
        "tool": {
            "diameter_mm": diameter,
            "teeth": teeth,
            "helix_deg": helix,
            "pitch_deg": [360.0 / teeth] * teeth,
        },
        "work": {"material": "AA6061-T6", "size_mm": [200, 150, 40]},
        "hole_diameter_mm": round(2.0 * cell.hole_radius / MM, 6),
        "instruments": {
            "dynamometer": {
                "rate_hz": cell.amplifier.rate,
                "reads": cell.reads,
                "axes": dict(axes),
                "rotation_deg": 0,
                "range_n": cell.amplifier.capacity,
                "noise_n": noise,
            }
        },
        "hidden": {},
    }
