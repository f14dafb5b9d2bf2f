"""A session of cutting: planned runs are cut by the true tool, and the dynamometer records them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol, TypeVar

import numpy as np

from virtual_cell.chips import Engagement, Tool
from virtual_cell.dynamometer import Dynamometer, record
from virtual_cell.milling import Coefficients, Cut, forces, scattered
from virtual_cell.motion import Motion, Orbit, Straight
from virtual_cell.units import DEG, MM, RPM, Array
from virtual_cell.write import Row, write_signal


@dataclass(frozen=True)
class Plan:
    """Nominal settings of one condition, in the units of the run table.

    ``air_s`` of the record lie before the block; None: the record is taken in full cut. ``full_s`` seconds
    are recorded in full cut, or in helical milling.
    """

    condition: str
    role: str
    operation: str
    spindle_rpm: float
    feed_per_tooth_mm: float
    axial_depth_mm: float
    radial_depth_mm: float
    direction: str = "slot"
    feed_direction_deg: float = 0.0
    cut_length_mm: float = 60.0
    full_s: float = 0.6
    air_s: float | None = None
    replicates: int = 1


@dataclass(frozen=True)
class Session:
    """The truth of a session of cutting.

    Attributes
    ----------
    tool, coefficients, dynamometer : as they really are, hidden effects included.
    hole_radius : m, of helical runs.
    scatter : relative run-to-run standard deviation of each coefficient. speed_error : largest relative error
        of speed.
    stiffness : (kx, ky) N/m along work x, y, or None. orbit_stiffness : amplitude and phase (rad) of the
        modulation of F_z.
    hard_spot : relative step of K_t for the second half of the session.
    depth, mean_chip : m, usual axial depth and mean chip thickness of the identification runs.
    """

    tool: Tool
    coefficients: Coefficients
    dynamometer: Dynamometer
    hole_radius: float = 0.0
    scatter: float = 0.01
    speed_error: float = 0.005
    stiffness: tuple[float, float] | None = None
    orbit_stiffness: tuple[float, float] = (0.0, 0.0)
    hard_spot: float = 0.0
    depth: float = 0.0
    mean_chip: float = 0.0


def orbit_rpm(session: Session, plan: Plan) -> float:
    """Orbit speed at which the tool's centre advances by the feed per tooth, rpm."""
    feed = plan.feed_per_tooth_mm * session.tool.teeth * plan.spindle_rpm
    return round(feed / (2.0 * math.pi * (session.hole_radius - session.tool.radius) / MM), 4)


class Repeated(Protocol):
    """What is done several times."""

    @property
    def replicates(self) -> int:
        """How often."""
        ...


Condition = TypeVar("Condition", bound=Repeated)


def spread(plans: Sequence[Condition], rng: np.random.Generator) -> list[tuple[Condition, int]]:
    """Order of cutting: replicate after replicate, each in random order, so that repeats span the session."""
    order: list[tuple[Condition, int]] = []
    for replicate in range(1, max(plan.replicates for plan in plans) + 1):
        block = [(plan, replicate) for plan in plans if plan.replicates >= replicate]
        order += [block[i] for i in rng.permutation(len(block))]
    return order


def cut_all(session: Session, plans: tuple[Plan, ...], folder: Path, rng: np.random.Generator) -> list[Row]:
    """Cut and record every run of a session into ``folder``; return the rows of the run table."""
    order = spread(plans, rng)
    rows, metres = [], 0.0
    for place, (plan, replicate) in enumerate(order, start=1):
        name = f"r{place:02d}"
        true = session if place <= len(order) // 2 else _harder(session)
        file = record_run(true, plan, folder, name, metres=metres, rng=rng)
        rows.append(row_of(session, plan, name, place, replicate) | {"dynamometer": file})
        metres += plan.cut_length_mm * MM
    return rows


def record_run(
    session: Session, plan: Plan, folder: Path, name: str, *, metres: float, rng: np.random.Generator
) -> str:
    """Cut and record one run, after ``metres`` of cut; return the file, relative to ``folder``."""
    time, read = _run(session, plan, metres, rng)
    return write_force(folder, name, time, read)


def write_force(folder: Path, run: str, time: Array, read: Array) -> str:
    """Write a dynamometer file; return its path relative to ``folder``."""
    file = f"force/{run}.parquet"
    signals = {axis: read[:, i] for i, axis in enumerate(("fx_n", "fy_n", "fz_n"))}
    write_signal(folder / file, {"t_s": time, **signals})
    return file


def _harder(session: Session) -> Session:
    k = session.coefficients
    return replace(session, coefficients=replace(k, ktc=k.ktc * (1.0 + session.hard_spot)))


def row_of(session: Session, plan: Plan, name: str, place: int, replicate: int) -> Row:
    """Row of the run table with the nominal settings of a run."""
    row: Row = {key: getattr(plan, key) for key in plan.__dataclass_fields__ if not key.endswith("_s")}
    row |= {"run": name, "replicate": replicate, "order": place}
    if plan.operation == "helical":
        row |= {"orbit_rpm": orbit_rpm(session, plan), "feed_direction_deg": None}
    return row


def _motion(session: Session, plan: Plan, rng: np.random.Generator) -> tuple[Motion, float]:
    """Path of the tool (programmed feed, whatever the spindle does) and the length of the record, s."""
    speed = plan.feed_per_tooth_mm * MM * session.tool.teeth * plan.spindle_rpm / 60.0
    if plan.operation == "helical":
        radius = session.hole_radius - session.tool.radius
        rate = orbit_rpm(session, plan) * RPM
        return Orbit(radius, rate, rng.uniform(0.0, 2.0 * math.pi), plan.axial_depth_mm * MM), plan.full_s
    radius, edge = session.tool.radius, session.tool.radius - plan.radial_depth_mm * MM
    side = "slot" if plan.operation == "slot" else plan.direction
    if plan.air_s is None:
        return Straight(speed, 10.0 * radius, side=side, edge=edge), plan.full_s
    start = -radius - speed * plan.air_s
    return Straight(speed, start, side=side, edge=edge), plan.air_s + radius / speed + plan.full_s


def _run(session: Session, plan: Plan, metres: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Record one run: its own coefficients, speed, start phase and zeros."""
    spindle = plan.spindle_rpm * RPM * (1.0 + session.speed_error * rng.uniform(-1.0, 1.0))
    coefficients = scattered(session.coefficients, session.scatter, rng)
    phase = rng.uniform(0.0, 2.0 * math.pi)
    motion, duration = _motion(session, plan, rng)
    turn = plan.feed_direction_deg * DEG if plan.operation != "helical" else 0.0
    engagement = Engagement(session.tool, motion, spindle, phase, plan.axial_depth_mm * MM)
    cut = Cut(engagement, coefficients, metres, _turned(session, turn))

    def on_tool(t: Array) -> Array:
        force = forces(cut, t)
        amplitude, towards = session.orbit_stiffness
        if plan.operation == "helical":
            force[:, 2] *= 1.0 + amplitude * np.cos(motion.direction(t) - towards)
        c, s = math.cos(turn), math.sin(turn)
        rotated: Array = force @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        return rotated

    return record(session.dynamometer, on_tool, duration, rng)


def _turned(session: Session, turn: float) -> Array | None:
    """Compliance (2, 2) of the tip, m/N, seen from a feed frame turned by ``turn``."""
    if session.stiffness is None:
        return None
    c, s = math.cos(turn), math.sin(turn)
    to_work = np.array([[c, -s], [s, c]])
    seen: Array = to_work.T @ np.diag(1.0 / np.array(session.stiffness)) @ to_work
    return seen
