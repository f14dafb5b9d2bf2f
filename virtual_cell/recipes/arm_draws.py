"""A cutting arm, its place and its cuts, drawn at random: what differs between batches of an arm."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from virtual_cell.arm import Arm, rotation_rpy
from virtual_cell.arm_cell import ArmCell, Moves
from virtual_cell.arm_line import Line, line
from virtual_cell.chips import Tool
from virtual_cell.dynamometer import Dynamometer
from virtual_cell.milling import Coefficients, in_millimetres
from virtual_cell.recipes.kr160 import ARM, DRIVES, LOAD_POSES_DEG, NEAR_DEG
from virtual_cell.session import Plan
from virtual_cell.side_force import SideCut, full_cut
from virtual_cell.units import DEG, MM, Array

LEAD = 18.0 * MM  # of the path before and after the tool is over the block
_AXES = (
    {"x": "-y", "y": "-x", "z": "-z"},
    {"x": "x", "y": "y", "z": "z"},
    {"x": "y", "y": "-x", "z": "z"},
)
_DECLINED = (
    0.12  # least singular value of the tip's Jacobian: farther than that from where the wrist is stretched
)
_TRIES = 60
_CALIBRATION = 0.01  # relative, standard deviation of each axis, gauge and joint from its data sheet


@dataclass(frozen=True)
class Way:
    """A wall: which way the feed goes (deg), whether the cut is up or down, and at which depths, mm."""

    feed_direction_deg: float
    direction: str
    axial_depth_mm: float
    radial_depth_mm: float


@dataclass(frozen=True)
class Bench:
    """What a batch of an arm is made on and with.

    Attributes
    ----------
    size : of the block, m. tool, metal, sensor : as they are; ``axes`` of the sensor in words.
    period : of the robot's log, s. stylus, tracker : noise of profiler and of load tests, m. zero : how well
        the zero of a trace is the programmed wall, m, standard deviation.
    loads : N, of the load tests, pulled and pushed. poses : of the load tests, beside that of the cuts, rad.
    calibration : relative errors of the dynamometer along the work's axes and, last, of the gauge of the load
        tests.
    """

    size: tuple[float, float, float]
    tool: Tool
    metal: Coefficients
    sensor: Dynamometer
    axes: Mapping[str, str]
    period: float
    stylus: float
    tracker: float
    zero: float
    loads: tuple[float, float]
    poses: Mapping[str, Array]
    calibration: Array
    repeats: int = 1
    lines: Mapping[Way, Line] = field(default_factory=dict)
    plans: tuple[Plan, ...] = ()


def drawn(rng: np.random.Generator, style: str) -> tuple[ArmCell, Bench]:
    """Draw an arm and its bench.

    In style ``a`` the programme is always the same; in ``b`` the poses, the instruments and how well they are
    calibrated, the block, and the number of runs differ. In half of the batches joints turn round within the
    cuts: the place of the work is drawn until they do, or do not.
    """
    bench = _bench(rng, style)
    drives = replace(
        DRIVES,
        coulomb=DRIVES.coulomb * np.exp(rng.normal(0.0, 0.2, 6)),
        viscous=DRIVES.viscous * np.exp(rng.normal(0.0, 0.2, 6)),
        torque_noise=float(round(rng.uniform(1.5, 6.0), 1)) if style == "b" else 3.0,
    )
    tip = ARM.tip + rng.uniform(-30.0, 30.0, 3).round(1) * MM
    arm = replace(ARM, tip=tip, stiffness=ARM.stiffness * np.exp(rng.normal(0.0, 0.15, 6)))
    wanted = bool(rng.uniform() < 0.5)
    for attempt in itertools.count():
        plans = _plans(rng, style)
        origin, turn = _place(rng, style)
        try:
            lines = lines_of(arm, bench, plans, origin, turn)
        except (RuntimeError, np.linalg.LinAlgError):
            continue
        by_role = {role: turning_of(bench, plans, lines, role) for role in ("identify", "validate")}
        turning = by_role["identify"] & by_role["validate"]
        if attempt > _TRIES or (turning if wanted else not (by_role["identify"] | by_role["validate"])):
            break
    swaying = _swaying(arm, bench, plans, lines, turn)
    bench = replace(bench, lines=lines, plans=plans)
    moves = moves_of(arm, bench, turn, (tuple(sorted(turning)), swaying))
    gains = rng.spawn(1)[0].normal(0.0, _CALIBRATION, 6) if style == "b" else np.zeros(6)
    cell = ArmCell(arm, drives, origin, turn, moves, torque_gain=tuple(gains.tolist()))
    return cell, bench


def _bench(rng: np.random.Generator, style: str) -> Bench:
    varied = style == "b"
    shear = np.array([958.0, 420.0, 210.0]) * np.exp(rng.normal(0.0, 0.12, 3))
    edge = np.array([18.0, 22.0, 4.0]) * np.exp(rng.normal(0.0, 0.15, 3))
    words = _AXES[rng.integers(len(_AXES))] if varied else _AXES[0]
    rows = np.zeros((3, 3))
    for i, axis in enumerate("xyz"):
        rows[i, "xyz".index(words[axis][-1])] = -1.0 if words[axis].startswith("-") else 1.0
    reads = str(rng.choice(["work", "tool"])) if varied else "work"
    noise = float(round(rng.uniform(0.8, 3.0), 2)) if varied else 1.5
    rate = float(rng.choice([1000.0, 1600.0, 2000.0])) if varied else 2000.0
    size = (100.0, 80.0, 30.0)
    if varied:
        size = (float(rng.choice([90.0, 120.0, 150.0])), float(rng.choice([80.0, 100.0])), 30.0)
    poses = {name: np.array(angles) * DEG for name, angles in LOAD_POSES_DEG.items()}
    more = int(rng.integers(0, 3)) if varied else 0
    for i in range(more):
        base = np.array(LOAD_POSES_DEG["p2"]) * DEG
        poses[f"p{6 + i}"] = base + rng.uniform(-0.5, 0.5, 6).round(3)
    return Bench(
        size=(size[0] * MM, size[1] * MM, size[2] * MM),
        tool=Tool(8.0 * MM, 35.0 * DEG, np.arange(3) * 120.0 * DEG),
        metal=in_millimetres(shear.tolist(), edge.tolist()),
        sensor=Dynamometer(rate, reads, rows, noise=noise, step=0.2),
        axes=words,
        period=float(rng.choice([0.004, 0.012])) if varied else 0.012,
        stylus=float(round(rng.uniform(0.3, 1.0), 2)) * 1e-6 if varied else 0.5e-6,
        tracker=float(round(rng.uniform(3.0, 10.0), 1)) * 1e-6 if varied else 5e-6,
        zero=float(round(rng.uniform(1.0, 5.0), 1)) * 1e-6 if varied else 3e-6,
        loads=(300.0, float(rng.choice([700.0, 900.0]))) if varied else (300.0, 900.0),
        poses=poses,
        calibration=rng.spawn(1)[0].normal(0.0, _CALIBRATION, 4) if varied else np.zeros(4),
        repeats=int(rng.integers(1, 3)) if varied else 1,
    )


def _place(rng: np.random.Generator, style: str) -> tuple[Array, Array]:
    """Draw origin (3,), m, and axes (3, 3) of the work in the base."""
    about, yaw = np.array([1510.0, -210.0, 590.0]), 190.0
    reach, turned = ((230.0, 400.0, 200.0), 40.0) if style == "b" else ((150.0, 300.0, 150.0), 25.0)
    origin = about + (rng.uniform(-1.0, 1.0, 3) * reach).round(1)
    angle = float(round(yaw + rng.uniform(-turned, turned), 1))
    return origin * MM, rotation_rpy(0.0, 0.0, angle * DEG)


def _plans(rng: np.random.Generator, style: str) -> tuple[Plan, ...]:
    """Draw the conditions; two feed directions at least, up and down, depths and feeds that differ."""
    shift = float(rng.choice([0.0, 90.0]))
    first, second, third = (
        shift,
        shift + 180.0,
        (shift + 90.0 if rng.uniform() < 0.5 else shift + 270.0) % 360.0,
    )
    rpm = 4000.0
    deep, shallow = (float(round(v, 1)) for v in (rng.uniform(5.0, 8.0), rng.uniform(2.5, 4.5)))
    slow, middle, fast = (0.05, 0.08, 0.12) if style == "a" else (0.045, 0.075, 0.11)
    if style == "b":
        rpm = float(rng.choice([3500.0, 4000.0, 5000.0]))

    def planned(
        direction: str,
        settings: tuple[float, float],
        towards: float,
        replicates: int = 1,
        role: str = "identify",
    ) -> Plan:
        depth, feed = settings
        name = f"{direction}-{depth:g}-{feed:g}-{towards:g}"
        return Plan(*(name, role, "side", rpm, feed, depth, 4.0, direction, towards), replicates=replicates)

    identify = [
        planned("down", (deep, slow), first, 2),
        planned("down", (shallow, fast), second, 2),
        planned("up", (shallow, middle), first, 2),
        planned("up", (deep, fast), third, 2),
        planned("down", (deep, middle), third, 1),
        planned("up", (shallow, slow), second, 1),
    ]
    validate = [
        planned("down", (deep, middle), second, 2, "validate"),
        planned("up", (deep, slow), first, 1, "validate"),
        planned("down", (shallow, fast), third, 1, "validate"),
    ]
    if style == "b":
        identify = identify[: int(rng.integers(4, 7))]
        validate = validate[: int(rng.integers(2, 4))]
    return (*identify, *validate)


def way(plan: Plan) -> Way:
    """Wall of a condition."""
    return Way(plan.feed_direction_deg, plan.direction, plan.axial_depth_mm, plan.radial_depth_mm)


def speed(bench: Bench, plan: Plan) -> float:
    """Feed, m/s."""
    return plan.feed_per_tooth_mm * MM * bench.tool.teeth * plan.spindle_rpm / 60.0


def side_cut(bench: Bench, plan: Plan, metal: Coefficients) -> SideCut:
    """Return what a condition cuts, of a metal as it is in one run."""
    return SideCut(
        bench.tool,
        metal,
        plan.spindle_rpm,
        speed(bench, plan),
        plan.axial_depth_mm * MM,
        plan.radial_depth_mm * MM,
        plan.direction,
        side(bench, way(plan)).length,
    )


@dataclass(frozen=True)
class Side:
    """Where a wall lies in the work frame.

    ``along``, ``across`` (3,) axes x and y of the feed frame; ``inward`` sign of y into the material;
    ``length`` m; ``start`` (3,) m, of the axis over the face where the tool enters.
    """

    along: Array
    across: Array
    inward: float
    length: float
    start: Array

    @property
    def normal(self) -> Array:
        """Direction (3,) out of the remaining material."""
        return -self.inward * self.across


def side(bench: Bench, one: Way) -> Side:
    """Place of a wall at one of the block's sides, whose corner is the work's origin."""
    c, s = (float(round(f(one.feed_direction_deg * DEG))) for f in (math.cos, math.sin))
    along, across = np.array([c, s, 0.0]), np.array([-s, c, 0.0])
    inward = 1.0 if one.direction == "up" else -1.0
    size = np.array(bench.size)
    faces = np.sort([0.0, float(across[:2] @ size[:2])])
    free = faces[0] if inward > 0.0 else faces[1]
    beside = free + inward * (one.radial_depth_mm * MM - bench.tool.radius)
    first = min(0.0, float(along[:2] @ size[:2]))
    start = first * along + beside * across - np.array([0.0, 0.0, one.axial_depth_mm * MM])
    return Side(along, across, inward, float(np.abs(along[:2] @ size[:2])), start)


def entry(bench: Bench) -> float:
    """Length of a line, m, at which the axis is over the face where the tool enters."""
    return LEAD + bench.tool.radius


def lines_of(arm: Arm, bench: Bench, plans: Sequence[Plan], origin: Array, turn: Array) -> Mapping[Way, Line]:
    """Lines of all walls.

    Raises
    ------
    RuntimeError
        A place is out of reach, or the arm is stretched there.
    """
    over = np.array([0.5 * bench.size[0], 0.5 * bench.size[1], 0.0])
    near = arm.reach(over @ turn.T + origin, turn, np.array(NEAR_DEG) * DEG)
    lines = {}
    for one in dict.fromkeys(way(plan) for plan in plans):
        wall = side(bench, one)
        before = entry(bench) * wall.along
        first, last = wall.start - before, wall.start + wall.length * wall.along + before
        lines[one] = line(arm, (first @ turn.T + origin, last @ turn.T + origin), turn, near)
        for q in lines[one].q[:: len(lines[one].q) - 1]:
            if np.linalg.svd(arm.jacobian(q), compute_uv=False)[-1] < _DECLINED:
                raise RuntimeError("the arm is stretched")
    return lines


def turning_of(bench: Bench, plans: Sequence[Plan], lines: Mapping[Way, Line], role: str) -> set[int]:
    """Joints that turn round where the tool is over the block, in a run of a role."""
    joints = set()
    for plan in plans:
        if plan.role == role:
            along = lines[way(plan)]
            first, last = entry(bench), along.length - entry(bench)
            joints |= {
                j for j, places in enumerate(along.turns) if ((places > first) & (places < last)).any()
            }
    return joints


def _swaying(
    arm: Arm, bench: Bench, plans: Sequence[Plan], lines: Mapping[Way, Line], turn: Array
) -> tuple[int, ...]:
    """Joints on which the torque of the cut changes its sign within a run."""
    joints = set()
    for plan in plans:
        wall, along = side(bench, way(plan)), lines[way(plan)]
        feed = np.stack([wall.along, wall.across, [0.0, 0.0, 1.0]])
        force = full_cut(side_cut(bench, plan, bench.metal)) @ feed @ turn.T
        over = (along.s > entry(bench)) & (along.s < along.length - entry(bench))
        torque = np.array([arm.jacobian(q)[:3].T @ force for q in along.q[over]])
        joints |= set(np.flatnonzero((torque.min(axis=0) < 0.0) & (torque.max(axis=0) > 0.0)).tolist())
    return tuple(sorted(joints))


def moves_of(
    arm: Arm,
    bench: Bench,
    turn: Array,
    special: tuple[tuple[int, ...], tuple[int, ...]],
) -> Moves:
    """How the joints move in the cuts; ``special``: those that turn round, those whose torque sways."""
    plans, lines = bench.plans, bench.lines
    gives = []
    for plan in plans:
        wall, along = side(bench, way(plan)), lines[way(plan)]
        feed = np.stack([wall.along, wall.across, [0.0, 0.0, 1.0]])
        force = full_cut(side_cut(bench, plan, bench.metal)) @ feed @ turn.T
        linear = arm.jacobian(along.q[len(along.q) // 2])[:3]
        gives.append(np.abs((turn @ wall.normal) @ linear * (linear.T @ force) / arm.stiffness))
    travel = np.mean(
        [np.abs(np.diff(one.q, axis=0)).sum(axis=0) / one.length for one in lines.values()], axis=0
    )
    lever = np.mean([np.linalg.norm(arm.jacobian(one.q[0])[:3], axis=0) for one in lines.values()], axis=0)
    speeds = [speed(bench, plan) for plan in plans]
    seconds = float(np.mean([lines[way(p)].length / v for p, v in zip(plans, speeds, strict=True)]))
    return Moves(
        tuple(travel.tolist()),
        *special,
        (min(speeds), max(speeds)),
        tuple(lever.tolist()),
        seconds,
        tuple(np.mean(gives, axis=0).tolist()),
    )
