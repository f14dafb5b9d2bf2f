"""A shift of one machine: batch after batch by one tool, which wears, on a spindle that warms up.

Every batch has slots and a side cut with a dynamometer and then faces that are scanned, all in one metal.
The edges wear with the metres cut since the first batch; tool and spindle grow while a face is milled, ever
more slowly as the machine gets warm. What the day makes of the machine besides is drawn for each batch.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from virtual_cell.dynamometer import Dynamometer
from virtual_cell.milling import Coefficients
from virtual_cell.recipes import faces
from virtual_cell.recipes.faces_draws import Case, FaceCell, LoadTests, drawn
from virtual_cell.session import Plan, Session, cut_in_order, spread
from virtual_cell.units import MM, N_MM, N_MM2, UM
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_yaml

START = datetime(2026, 3, 2, 6, 0, tzinfo=UTC)
_EVERY, _LATE = 30.0, 6.0  # minutes from batch to batch, and how much more or less
_BETWEEN = 0.04  # relative, of the growth in a batch about its course
_METAL_BETWEEN = 0.005  # relative, of each coefficient: bars of one metal differ
_AIR_S, _FULL_S, _SLOT_MM = 0.05, 0.2, 100.0
SIZE = (0.12, 0.08)  # of the plate, m
LOADS = LoadTests(
    tuple((x, y) for x in (10.0, 60.0, 110.0) for y in (10.0, 40.0, 70.0)), (150.0, 250.0), 2, 2.0 * UM
)
_SENSOR = Dynamometer(12800.0, "work", np.eye(3), noise=1.5)
CASES = (
    Case("A", 1, "L", 2.0, "identify", 2),
    Case("A", 1, "T", 1.2, "identify", 2),
    Case("B", 1, "T", 2.0, "identify", 1),
    Case("B", 1, "L", 1.2, "validate", 1),
)


@dataclass(frozen=True)
class Day:
    """The courses of a shift.

    ``wear``: relative growth of the edge coefficients per metre. ``growth``: of tool and spindle while a face
    is milled, um/min: of the cold machine, and of the warm one; ``minutes``: time constant between them.
    """

    wear: float
    growth: tuple[float, float]
    minutes: float

    def growing(self, minutes: float) -> float:
        """Growth, um/min, so long after the first batch."""
        cold, warm = self.growth
        return warm + (cold - warm) * math.exp(-minutes / self.minutes)


def make(folder: Path, batches: int, seed: int) -> Row:
    """Write the batches ``b-1`` … of a shift into a folder; return the truth.

    Returns
    -------
    ``day``: the courses; ``batches``: of each one its minute, its coefficients in the middle of the cuts with
    a dynamometer (contract's units), the growth by its course and in this batch (um/min), metres cut before.
    """
    rng = np.random.default_rng([seed, 53])
    cell = replace(drawn(rng, "a", CASES), size=SIZE, loads=LOADS)
    cold, tau = float(rng.uniform(40.0, 70.0)), float(rng.uniform(90.0, 150.0))
    day = Day(round(float(rng.uniform(0.002, 0.004)), 5), (round(cold, 2), 4.0), round(tau, 1))
    cell = _metal(cell, replace(cell.milling.metal, wear=day.wear))
    metres, truth = 0.0, {}
    for number in range(batches):
        minutes = round(number * _EVERY + (rng.uniform(-_LATE, _LATE) if number else 0.0), 1)
        growth = day.growing(minutes) * (1.0 + _BETWEEN * rng.standard_normal())
        name, own = f"b-{number + 1}", _bar(cell, rng)
        warm = replace(own, around=replace(own.around, growth=growth * UM / 60.0))
        slots, cut = _batch(folder / name, warm, minutes, metres, rng)
        middle = cell.milling.metal.after(metres + 0.5 * slots)
        truth[name] = {
            "minutes": minutes,
            "metres_before": round(metres, 6),
            "coefficients": _in_words(middle),
            "growth": day.growing(minutes),
            "growth_here": growth,
        }
        metres += cut
    return {"seed": seed, "day": asdict(day), "batches": truth}


def _metal(cell: FaceCell, metal: Coefficients) -> FaceCell:
    return replace(cell, milling=replace(cell.milling, metal=metal))


def _bar(cell: FaceCell, rng: np.random.Generator) -> FaceCell:
    """Return the cell with the metal of another bar."""
    metal = cell.milling.metal
    factors = dict(zip(("ktc", "krc", "kac"), 1.0 + _METAL_BETWEEN * rng.standard_normal(3), strict=True))
    return _metal(cell, replace(metal, **{name: getattr(metal, name) * f for name, f in factors.items()}))


def _in_words(metal: Coefficients) -> Mapping[str, float]:
    """Return coefficients by name, in the units of the contract."""
    shear = {name: getattr(metal, name) / N_MM2 for name in ("ktc", "krc", "kac")}
    return shear | {name: getattr(metal, name) / N_MM for name in ("kte", "kre", "kae")}


def _batch(
    folder: Path, cell: FaceCell, minutes: float, metres: float, rng: np.random.Generator
) -> tuple[float, float]:
    """Write a batch of a tool that has cut so many metres; return those of its slots and all of its own."""
    fresh_folder(folder)
    mill = cell.milling
    session = Session(mill.tool, mill.metal, _SENSOR)
    order = spread(_plans(cell), rng)
    rows = cut_in_order(session, order, folder, rng, metres=metres)
    slots = sum(row["cut_length_mm"] for row in rows) * MM
    rows += faces.mill_all(folder, cell, rng, after=len(rows), metres=metres + slots)
    rows[0]["started_at"] = (START + timedelta(minutes=minutes)).isoformat()
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    write_csv(folder / "loads.csv", faces.tested(folder, cell, rng))
    write_yaml(folder / "cell.yaml", {"cell": "shift-mill"})
    write_yaml(folder / "batch.yaml", _manifest(folder.name, cell))
    return slots, float(sum(row["cut_length_mm"] for row in rows) * MM)


def _plans(cell: FaceCell) -> tuple[Plan, ...]:
    """Return the cuts with a dynamometer: three slots and a side cut identify, a slot is held out."""
    rpm, diameter = cell.milling.spindle_rpm, 2.0 * cell.milling.tool.radius / MM
    slot = Plan(
        *("slot", "identify", "slot", rpm, 0.05, 2.0, diameter),
        cut_length_mm=_SLOT_MM, full_s=_FULL_S, air_s=_AIR_S, replicates=2,
    )  # fmt: skip

    def at(plan: Plan, feed: float) -> Plan:
        return replace(plan, condition=f"{plan.operation}-{feed:g}", feed_per_tooth_mm=feed)

    down = replace(slot, operation="side", direction="down", radial_depth_mm=cell.milling.width / MM)
    return (
        *(at(slot, feed) for feed in (0.02, 0.05, 0.08)),
        at(down, 0.05),
        replace(at(slot, 0.065), role="validate", replicates=1),
    )


def _manifest(name: str, cell: FaceCell) -> Row:
    """Return batch.yaml: the coefficients are not declared, but identified from the batch's own forces."""
    content = {key: value for key, value in faces.manifest(name, cell).items() if key != "coefficients"}
    sensor = {"rate_hz": _SENSOR.rate, "reads": "work", "range_n": _SENSOR.capacity, "noise_n": _SENSOR.noise}
    title = "Slots and faces of one shift, by one tool"
    return content | {
        "title": title, "cell": "shift-mill", "instruments": content["instruments"] | {"dynamometer": sensor},
    }  # fmt: skip
