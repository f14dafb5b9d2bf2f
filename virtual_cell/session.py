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
        modulation of F_z, ``orbit_harmonic`` times per orbit.
    hard_spot, hard_from : relative step of K_t, and the share of the session after which it comes.
    speed_exponent, speed_reference : shear coefficients go as (speed/reference)^−exponent; rad/s.
    growth : m, how much deeper the tool cuts at the end of the session, because it grew as it warmed up.
    tilt : depth of cut gained per length travelled along work x.
    depth, mean_chip : m, usual axial depth and mean chip thickness of the identification runs.
    tacho : whether the angle of the spindle is recorded, from an arbitrary zero.
    """

    tool: Tool
    coefficients: Coefficients
    dynamometer: Dynamometer
    hole_radius: float = 0.0
    scatter: float = 0.01
    speed_error: float = 0.005
    stiffness: tuple[float, float] | None = None
    orbit_stiffness: tuple[float, float] = (0.0, 0.0)
    orbit_harmonic: int = 1
    hard_spot: float = 0.0
    hard_from: float = 0.5
    speed_exponent: float = 0.0
    speed_reference: float = 1.0
    growth: float = 0.0
    tilt: float = 0.0
    depth: float = 0.0
    mean_chip: float = 0.0
    tacho: bool = False


class Holed(Protocol):
    """What cuts helical holes with a tool."""

    @property
    def tool(self) -> Tool:
        """The tool."""
        ...

    @property
    def hole_radius(self) -> float:
        """Of the holes, m."""
        ...


def orbit_rpm(session: Holed, plan: Plan) -> float:
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
    return cut_in_order(session, spread(plans, rng), folder, rng)


def cut_in_order(
    session: Session,
    order: Sequence[tuple[Plan, int]],
    folder: Path,
    rng: np.random.Generator,
    *,
    after: int = 0,
    metres: float = 0.0,
) -> list[Row]:
    """Cut and record runs (plan, replicate) one after another; return their rows.

    ``after`` so many runs that cut so many ``metres``; they are the session, the runs come after its end.
    """
    rows = []
    for place, (plan, replicate) in enumerate(order, start=after + 1):
        name = f"r{place:02d}"
        true, deeper = _later(session, plan, (place - 1) / (after or len(order)))
        file = record_run(true, deeper, folder, name, metres=metres, rng=rng)
        rows.append(row_of(session, plan, name, place, replicate) | {"dynamometer": file})
        metres += plan.cut_length_mm * MM
    return rows


def record_run(
    session: Session, plan: Plan, folder: Path, name: str, *, metres: float, rng: np.random.Generator
) -> str:
    """Cut and record one run, after ``metres`` of cut; return the file, relative to ``folder``."""
    time, read, angle = _run(session, plan, metres, rng)
    return write_force(folder, name, time, read, angle if session.tacho else None)


def write_force(folder: Path, run: str, time: Array, read: Array, angle: Array | None = None) -> str:
    """Write a dynamometer file, with the angle of the spindle (rad) where there is a tacho.

    Returns its path relative to ``folder``.
    """
    file = f"force/{run}.parquet"
    signals = {axis: read[:, i] for i, axis in enumerate(("fx_n", "fy_n", "fz_n"))}
    if angle is not None:
        signals["spindle_deg"] = np.mod(angle, 2.0 * math.pi) / DEG
    write_signal(folder / file, {"t_s": time, **signals})
    return file


def _later(session: Session, plan: Plan, share: float) -> tuple[Session, Plan]:
    """Return what is cut, and how deep, when a share of the session has passed."""
    k = session.coefficients
    if share >= session.hard_from:
        k = replace(k, ktc=k.ktc * (1.0 + session.hard_spot))
    warm = (1.0 - math.exp(-3.0 * share)) / (1.0 - math.exp(-3.0))
    depth = plan.axial_depth_mm + session.growth * warm / MM
    return replace(session, coefficients=k), replace(plan, axial_depth_mm=depth)


def row_of(session: Holed, plan: Plan, name: str, place: int, replicate: int) -> Row:
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


def _run(session: Session, plan: Plan, metres: float, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Record one run, with its own coefficients, speed, start phase and zeros: times, readings, angle."""
    spindle = plan.spindle_rpm * RPM * (1.0 + session.speed_error * rng.uniform(-1.0, 1.0))
    coefficients = scattered(session.coefficients, session.scatter, rng)
    coefficients = coefficients.softened((spindle / session.speed_reference) ** -session.speed_exponent)
    phase = rng.uniform(0.0, 2.0 * math.pi)
    motion, duration = _motion(session, plan, rng)
    turn = plan.feed_direction_deg * DEG if plan.operation != "helical" else 0.0
    engagement = Engagement(session.tool, motion, spindle, phase, plan.axial_depth_mm * MM)
    cut = Cut(engagement, coefficients, metres, _turned(session, turn))

    def on_tool(t: Array) -> Array:
        force = _on_a_slope(cut, t, session.tilt, turn)
        amplitude, towards = session.orbit_stiffness
        if plan.operation == "helical":
            force[:, 2] *= 1.0 + amplitude * np.cos(session.orbit_harmonic * motion.direction(t) - towards)
        c, s = math.cos(turn), math.sin(turn)
        rotated: Array = force @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        return rotated

    time, read = record(session.dynamometer, on_tool, duration, rng)
    return time, read, phase + spindle * time


def _on_a_slope(cut: Cut, t: Array, tilt: float, turn: float) -> Array:
    """Force (n, 3), N, in work that gets thicker by ``tilt`` per length along work x.

    Interpolated between the least and the largest depth; the depth is right at the record's start. ``turn``
    leads from the work frame to that of the motion.
    """
    if tilt == 0.0:
        return forces(cut, t)
    (x, y), (x0, y0) = (cut.engagement.motion.centre(moment) for moment in (t, np.zeros(1)))
    deeper = tilt * ((x - x0) * math.cos(turn) - (y - y0) * math.sin(turn))
    ends = float(deeper.min()), float(deeper.max())
    low, high = (replace(cut.engagement, depth=cut.engagement.depth + end) for end in ends)
    share = ((deeper - ends[0]) / (ends[1] - ends[0]))[:, None]
    shallow, deep = (forces(replace(cut, engagement=one), t) for one in (low, high))
    ramp: Array = shallow * (1.0 - share) + deep * share
    return ramp


def _turned(session: Session, turn: float) -> Array | None:
    """Compliance (2, 2) of the tip, m/N, seen from a feed frame turned by ``turn``."""
    if session.stiffness is None:
        return None
    c, s = math.cos(turn), math.sin(turn)
    to_work = np.array([[c, -s], [s, c]])
    seen: Array = to_work.T @ np.diag(1.0 / np.array(session.stiffness)) @ to_work
    return seen
