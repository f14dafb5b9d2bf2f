"""A milling cell with a dynamometer in the harder world, and how one run is cut and recorded in it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from virtual_cell.motion import Straight
from virtual_cell.session import Plan, orbit_rpm
from virtual_cell.units import DEG, MM, RPM, Array
from virtual_cell.world.force import amplifier as amplifying
from virtual_cell.world.force.amplifier import Amplifier
from virtual_cell.world.force.cause import Cause, Moment
from virtual_cell.world.force.cutter import RealTool, Wear
from virtual_cell.world.force.cutting import Pass, TrueEngagement, edge_force, on_a_ramp
from virtual_cell.world.force.metal import Metal, factors
from virtual_cell.world.force.people import SHORT, Habits
from virtual_cell.world.force.pickup import Pickup, picked_up
from virtual_cell.world.force.spindle import Spindle, Turning, grid, turning
from virtual_cell.world.force.table import Table
from virtual_cell.world.force.travel import Circling, Travel, travelled, wobbling
from virtual_cell.world.force.yielding import Holder, swinging_force

MARGIN = 0.05  # s before and after a record, in which the table's modes settle
LEAST_FINE = 18e3  # Hz at which forces are computed, at least
AFTER = 0.12  # s of air recorded after a cut that is recorded whole


@dataclass(frozen=True)
class Cell:
    """The truth of a session: everything that the harder world has of a force measurement.

    Attributes
    ----------
    axes : (3, 3), row i the direction of sensor axis i in the work frame, as declared. reads : force on the
        ``work`` or on the ``tool``. hole_radius : of helical runs, m. holder : or None, where the tool is too
        stiff to matter. sway, sway_phase : m, rad, of the machine on helical paths. metres : cut in all.
    causes : what happens beside.
    """

    tool: RealTool
    metal: Metal
    wear: Wear
    spindle: Spindle
    table: Table
    amplifier: Amplifier
    pickup: Pickup
    habits: Habits
    axes: Array
    reads: str
    hole_radius: float
    tacho: bool
    metres: float = 1.0
    depth: float = 0.0
    holder: Holder | None = None
    sway: float = 0.0
    sway_phase: float = 0.0
    causes: tuple[Cause, ...] = ()


@dataclass(frozen=True)
class Recorded:
    """A record: times (n,), s, readings (n, 3), N, and the true angle of the spindle (n,), rad."""

    time: Array
    read: Array
    angle: Array


def cut_run(cell: Cell, plan: Plan, share: float, metres: float, rng: np.random.Generator) -> Recorded:
    """Cut and record one run when ``share`` of the session has passed and ``metres`` have been cut."""
    moment, programmed = _moment(cell, plan, share, metres, rng)
    motion = _motion(cell, moment, programmed, rng)
    turned = _turning(cell, moment, motion, rng)
    motion = _wobbling(cell, moment, motion, turned)
    one = _pass(cell, moment, motion, turned, rng)
    fast = 1.0 + cell.amplifier.fast
    count, margin = round(moment.duration * cell.amplifier.rate), math.ceil(MARGIN * cell.amplifier.rate)
    over = round(moment.rate / cell.amplifier.rate)
    t = (np.arange((count + 2 * margin) * over) - margin * over) / (moment.rate * fast)
    read = _felt(cell, moment, t, on_tool(cell, moment, one, motion, t))
    read = _kept(cell, read, margin * over, over, count, in_cut=_in_cut(motion))
    time = np.arange(count) / cell.amplifier.rate
    zero = amplifying.zeros(cell.amplifier, rng)
    read = read + zero + np.outer(time, cell.amplifier.drift)
    read = read + picked_up(cell.pickup, time, cell.amplifier.rate, rng)
    return Recorded(time, amplifying.converted(cell.amplifier, read), turned.at(time / fast))


def on_tool(cell: Cell, moment: Moment, one: Pass, motion: Travel | Circling, t: Array) -> Array:
    """Force (n, 3), N, on the tool in the work frame at even times ``t``."""
    turn = moment.turn
    force = edge_force(one, t) if cell.holder is None else swinging_force(one, t, cell.holder, turn)
    if isinstance(motion, Circling):
        force = on_a_ramp(one, motion, t, force)
    c, s = math.cos(turn), math.sin(turn)
    force = force @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    for cause in cell.causes:
        force = cause.load(moment, t, force)
    return np.asarray(force)


def programmed_moment(cell: Cell, plan: Plan, share: float = 0.0, metres: float = 0.0) -> Moment:
    """Return the moment of a run as it is programmed, recorded as long as it is planned."""
    rate = cell.amplifier.rate
    feed = plan.feed_per_tooth_mm * MM * cell.tool.teeth * plan.spindle_rpm / 60.0
    helical = plan.operation == "helical"
    return Moment(
        plan,
        share,
        metres,
        0,
        plan.full_s,
        feed,
        plan.spindle_rpm * RPM,
        0.0 if helical else plan.feed_direction_deg * DEG,
        rate * math.ceil(LEAST_FINE / rate),
    )


def _moment(
    cell: Cell, plan: Plan, share: float, metres: float, rng: np.random.Generator
) -> tuple[Moment, Straight | None]:
    """Decide how long a run is recorded, and from where; return the programmed cut, unless it is helical."""
    moment = replace(programmed_moment(cell, plan, share, metres), seed=int(rng.integers(2**31)))
    early = float(rng.uniform(0.75, 0.95)) if rng.uniform() < cell.habits.stops_early else 1.0
    late = rng.uniform() < cell.habits.no_air
    if plan.operation == "helical":
        return replace(moment, duration=plan.full_s), None
    radius, length = cell.tool.radius, plan.cut_length_mm * MM
    edge = radius - plan.radial_depth_mm * MM - cell.habits.width_off
    side = "slot" if plan.operation == "slot" else plan.direction
    if plan.air_s is None or late:
        start, duration = radius + 0.3 * max(length - radius - moment.feed * plan.full_s, 0.0), plan.full_s
    else:
        start = -radius - moment.feed * plan.air_s
        duration = plan.air_s + radius / moment.feed + plan.full_s
    whole = (length - start) / moment.feed + AFTER
    if length <= SHORT:
        duration = whole
    return replace(moment, duration=early * duration), Straight(moment.feed, start, length, side, edge)


def _motion(
    cell: Cell, moment: Moment, programmed: Straight | None, rng: np.random.Generator
) -> Travel | Circling:
    plan = moment.plan
    if programmed is None:
        return Circling(
            cell.hole_radius - cell.tool.radius,
            orbit_rpm(cell, plan) * RPM,
            rng.uniform(0.0, 2.0 * math.pi),
            plan.axial_depth_mm * MM,
            sway=cell.sway,
            sway_phase=cell.sway_phase,
        )

    def change(t: Array, x: Array) -> tuple[Array, Array]:
        changes = [cause.feed(moment, t, x) for cause in cell.causes]
        relative, across = np.zeros_like(t), np.zeros_like(t)
        for more, aside in changes:
            relative, across = relative + more, across + aside
        return relative, across

    short = programmed.length <= SHORT
    return travelled(
        programmed,
        moment.duration,
        ramp_s=cell.habits.ramp_s,
        reached=cell.habits.reached if short else 1.0,
        change=change if cell.causes else None,
    )


def _in_cut(motion: Travel | Circling) -> bool:
    return isinstance(motion, Circling) or motion.start > 0.0


def _turning(cell: Cell, moment: Moment, motion: Travel | Circling, rng: np.random.Generator) -> Turning:
    """Turn the spindle: it feels the cut where the tool comes into the block."""
    contact = (-10.0, 10.0 + moment.duration)
    if isinstance(motion, Travel):
        contact = (motion.reached(-0.8 * cell.tool.radius), motion.reached(motion.length))
        if motion.start > 0.0:
            contact = (-10.0, contact[1])
    t = grid(moment.duration)
    change: Array | float = 0.0
    for cause in cell.causes:
        change = change + cause.speed(moment, t)
    return turning(cell.spindle, moment.spindle, moment.duration, contact, rng=rng, change=change)


def _wobbling(cell: Cell, moment: Moment, motion: Travel | Circling, turned: Turning) -> Travel | Circling:
    for cause in cell.causes:
        motion = wobbling(motion, cause.wobble(moment, turned)) if motion.wobble is None else motion
    return motion


def _pass(
    cell: Cell, moment: Moment, motion: Travel | Circling, turned: Turning, rng: np.random.Generator
) -> Pass:
    """Return what is cut in this run: by how sharp a tool, how deep, in how hard a metal."""
    shear, edge, bottom = factors(cell.metal, moment.share, rng)
    nominal = moment.plan.axial_depth_mm * MM
    if not isinstance(motion, Circling):  # the pitch of a helix is the controller's, not the touching-off's
        nominal += cell.habits.depth(moment.share) + cell.habits.by_run * float(rng.standard_normal())
    return engaged(cell, moment, motion, turned, nominal=nominal, coefficients=(shear, edge, bottom))


def engaged(
    cell: Cell,
    moment: Moment,
    motion: Travel | Circling,
    turned: Turning,
    *,
    nominal: float,
    coefficients: tuple[Array, Array, Array],
) -> Pass:
    """Return a pass ``nominal`` (m) deep, by factors on shear, edge and bottom coefficients."""
    tool = cell.tool
    for cause in cell.causes:
        tool = cause.tool(moment, tool)

    def depth(t: Array, x: Array) -> Array:
        gained: Array | float = 0.0
        for cause in cell.causes:
            gained = gained + cause.depth(moment, t, x)
        return np.asarray(np.maximum(nominal + gained, 0.0))

    t = np.linspace(0.0, moment.duration, 200)
    deepest = float(np.max(depth(t, motion.centre(t)[0]))) + 2.0 * (
        motion.sway if isinstance(motion, Circling) else 0.0
    )
    engagement = TrueEngagement(
        tool, motion, moment.spindle, 0.0, deepest, turning=turned, bounds=tool.bounds(deepest)
    )
    changes = [cause.metal(moment) for cause in cell.causes]
    middle = moment.metres + 0.5 * moment.plan.cut_length_mm * MM
    return Pass(
        engagement,
        cell.metal,
        *coefficients,
        wear=cell.wear.growth(middle),
        changes=tuple(change for change in changes if change is not None),
        depth=depth,
    )


def _felt(cell: Cell, moment: Moment, t: Array, force: Array) -> Array:
    """Return what acts along the sensor's axes (n, 3), N."""
    rows = cell.axes @ cell.table.turned
    read: Array = force @ rows.T * (-1.0 if cell.reads == "work" else 1.0)
    for cause in cell.causes:
        read = cause.signal(moment, t, read)
    return read


def _kept(cell: Cell, read: Array, first: int, over: int, count: int, *, in_cut: bool) -> Array:
    """Return readings (count, 3), N, of what acts on the sensor, past mechanics, amplifier and filter."""
    fine = cell.amplifier.rate * over
    hz = np.fft.rfftfreq(len(read), 1.0 / fine)
    spectrum = np.einsum("nij,nj->ni", cell.table.response(hz), np.fft.rfft(read, axis=0))
    spectrum *= cell.amplifier.filter(hz)[:, None]
    moved = np.fft.irfft(spectrum, len(read), axis=0)
    held = read[: first + round(0.02 * fine)].mean(axis=0) if in_cut else np.zeros(3)
    left = amplifying.slow(cell.amplifier, moved, fine, held, 1.0 if in_cut else 0.0)
    kept: Array = left[first : first + count * over : over]
    return kept


def metres_of(plans: Sequence[Plan]) -> float:
    """Length (m) that is cut when every plan is cut as often as it says."""
    return float(sum(plan.cut_length_mm * MM * plan.replicates for plan in plans))
