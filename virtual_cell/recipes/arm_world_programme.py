"""What is cut on an arm of the harder world, where, when and with what: styles ``c`` and ``d``.

Style ``c`` is for tuning. Style ``d`` has other places, speeds, feeds, depths, rates and numbers of runs, and
other habits: which runs lack an idle log, and whether repeats are cut in clumps.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from virtual_cell.arm import Arm, rotation_rpy
from virtual_cell.arm_cell import Moves
from virtual_cell.chips import Tool
from virtual_cell.dynamometer import Dynamometer
from virtual_cell.milling import in_millimetres
from virtual_cell.recipes.arm_draws import (
    Bench,
    entry,
    lines_of,
    moves_of,
    side,
    side_cut,
    turning_of,
    way,
)
from virtual_cell.recipes.arm_world_day import Session, session
from virtual_cell.recipes.kr160 import ARM, DRIVES, LOAD_POSES_DEG
from virtual_cell.session import Plan
from virtual_cell.side_force import full_cut
from virtual_cell.units import DEG, MM, Array
from virtual_cell.world.arm import controller, gears, hose, joints, links
from virtual_cell.world.arm.robot import Robot
from virtual_cell.world.draws import between, per_joint, signed

_AXES = (
    {"x": "-y", "y": "-x", "z": "-z"},
    {"x": "x", "y": "y", "z": "z"},
    {"x": "-x", "y": "y", "z": "-z"},
    {"x": "y", "y": "-x", "z": "z"},
)
_RATED = np.array([2600.0, 3400.0, 1900.0, 700.0, 600.0, 380.0])  # N m of the joints
_STRETCHED = 0.11  # least singular value of the tip's Jacobian
_TRIES = 80


@dataclass(frozen=True)
class Habits:
    """What differs between the two styles: ranges and choices, each drawn per batch."""

    rpm: tuple[float, ...]
    feed: tuple[float, float]  # mm per tooth
    axial: tuple[float, float]  # mm
    radial: tuple[float, float]  # mm
    identify: tuple[int, int]  # conditions
    validate: tuple[int, int]
    sizes: tuple[tuple[float, float, float], ...]  # mm
    tools: tuple[tuple[float, int, float], ...]  # diameter mm, teeth, helix deg
    rate: tuple[float, ...]  # Hz
    period: tuple[float, ...]  # s
    away: tuple[float, float]  # of the work from the base over the usual distance
    height: tuple[float, float]  # mm
    bearing: float  # deg, on either side
    tilt: float  # deg
    clumps: float  # probability
    lacking: float  # probability that some runs have no idle log
    entries: float  # probability that holes were milled before


HABITS: Mapping[str, Habits] = {
    "c": Habits(
        rpm=(3200.0, 3800.0, 4500.0),
        feed=(0.045, 0.12),
        axial=(2.5, 7.0),
        radial=(2.0, 4.5),
        identify=(5, 7),
        validate=(2, 3),
        sizes=((110.0, 80.0, 35.0), (140.0, 90.0, 35.0)),
        tools=((16.0, 3, 35.0), (12.0, 3, 40.0)),
        rate=(1200.0, 2000.0),
        period=(0.004, 0.012),
        away=(0.92, 1.08),
        height=(380.0, 760.0),
        bearing=35.0,
        tilt=1.5,
        clumps=0.35,
        lacking=0.2,
        entries=0.2,
    ),
    "d": Habits(
        rpm=(2900.0, 3500.0, 4100.0, 5200.0),
        feed=(0.04, 0.13),
        axial=(2.0, 8.0),
        radial=(1.5, 5.0),
        identify=(5, 8),
        validate=(2, 4),
        sizes=((100.0, 100.0, 40.0), (130.0, 80.0, 40.0), (160.0, 90.0, 40.0)),
        tools=((16.0, 4, 38.0), (20.0, 3, 30.0), (12.0, 2, 30.0)),
        rate=(1500.0, 2500.0),
        period=(0.004, 0.008, 0.012),
        away=(0.86, 1.12),
        height=(300.0, 850.0),
        bearing=60.0,
        tilt=4.0,
        clumps=0.5,
        lacking=0.3,
        entries=0.4,
    ),
}


def drawn(rng: np.random.Generator, style: str) -> tuple[Robot, Bench, Session]:
    """Draw an arm, its bench and its day.

    The place of the work is drawn until joints turn round within its cuts, in four of five batches, or none
    does: what friction does is seen there.
    """
    habits = HABITS[style]
    bench = _bench(rng, habits)
    arm = replace(
        ARM,
        tip=ARM.tip + rng.uniform(-35.0, 35.0, 3).round(1) * MM,
        stiffness=ARM.stiffness * per_joint(rng, 0.75, 1.35),
    )
    wanted = bool(rng.uniform() < 0.8)
    for attempt in itertools.count():
        plans = _plans(rng, habits)
        origin, turn = _place(rng, habits)
        try:
            lines = lines_of(arm, bench, plans, origin, turn)
        except (RuntimeError, np.linalg.LinAlgError):
            continue
        both = [turning_of(bench, plans, lines, role) for role in ("identify", "validate")]
        turning = both[0] & both[1]
        if attempt > _TRIES or (turning if wanted else not (both[0] | both[1])):
            break
    bench = replace(bench, lines=lines, plans=plans)
    special = tuple(sorted(turning)), _swaying(arm, bench, turn)
    moves = moves_of(arm, bench, turn, special)
    near = next(iter(lines.values())).q[0]
    robot = _robot(rng, arm, moves, habits, place=(origin, turn), near=near)
    return (
        robot,
        bench,
        session(rng, plans, clumps=habits.clumps, lacking=habits.lacking, entries=habits.entries),
    )


def _robot(
    rng: np.random.Generator,
    arm: Arm,
    moves: Moves,
    habits: Habits,
    *,
    place: tuple[Array, Array],
    near: Array,
) -> Robot:
    return Robot(
        arm,
        *place,
        moves,
        joints.drawn(rng, DRIVES.coulomb, DRIVES.viscous),
        gears.springs(rng, arm.stiffness, _RATED),
        gears.transmission(rng),
        hose.drawn(rng, near),
        links.drawn(rng, arm.stiffness),
        controller.servo(rng, arm.stiffness, np.array(gears.RATIO)),
        controller.recorder(rng, habits.period),
    )


def _bench(rng: np.random.Generator, habits: Habits) -> Bench:
    shear = np.array([880.0, 360.0, 190.0]) * np.exp(rng.uniform(-0.25, 0.25, 3))
    edge = np.array([16.0, 19.0, 3.5]) * np.exp(rng.uniform(-0.3, 0.3, 3))
    words = _AXES[rng.integers(len(_AXES))]
    rows = np.zeros((3, 3))
    for i, axis in enumerate("xyz"):
        rows[i, "xyz".index(words[axis][-1])] = -1.0 if words[axis].startswith("-") else 1.0
    diameter, teeth, helix = habits.tools[rng.integers(len(habits.tools))]
    size = habits.sizes[rng.integers(len(habits.sizes))]
    sensor = Dynamometer(
        float(rng.choice(habits.rate)),
        str(rng.choice(["work", "tool"])),
        rows,
        noise=round(between(rng, 0.6, 3.5), 2),
        rotation=signed(rng, 0.2, 1.2) * DEG,
        offset=between(rng, 0.5, 8.0),
        step=float(rng.choice([0.1, 0.3])),
        slope=(signed(rng, 0.01, 0.3), signed(rng, 0.01, 0.3), signed(rng, 0.01, 0.3)),
    )
    poses = {
        f"p{i + 2}": (np.array(list(LOAD_POSES_DEG.values())[i % 4]) + rng.uniform(-22.0, 22.0, 6)).round(3)
        * DEG
        for i in range(int(rng.integers(4, 7)))
    }
    return Bench(
        size=(size[0] * MM, size[1] * MM, size[2] * MM),
        tool=Tool(0.5 * diameter * MM, helix * DEG, np.arange(teeth) * (360.0 / teeth) * DEG),
        metal=in_millimetres(shear.tolist(), edge.tolist()),
        sensor=sensor,
        axes=words,
        period=0.0,  # the period, the stylus and the tracker are those of the robot and of the session
        stylus=0.0,
        tracker=0.0,
        zero=0.0,
        loads=(float(rng.choice([200.0, 350.0])), float(rng.choice([650.0, 800.0, 1000.0]))),
        poses=poses,
        calibration=np.array([signed(rng, 0.003, 0.02) for _ in range(4)]),
        repeats=int(rng.integers(1, 4)),
    )


def _place(rng: np.random.Generator, habits: Habits) -> tuple[Array, Array]:
    """Draw origin (3,), m, and axes (3, 3) of the work in the base: on a table that is not quite level."""
    about = float(rng.uniform(-habits.bearing, habits.bearing))
    away, height = rng.uniform(*habits.away), float(rng.uniform(*habits.height))
    c, s = math.cos(about * DEG), math.sin(about * DEG)
    flat = away * np.array([[c, -s], [s, c]]) @ np.array([1470.0, -190.0])
    roll, pitch = rng.uniform(-habits.tilt, habits.tilt, 2).round(2)
    yaw = round(188.0 + about + float(rng.uniform(-35.0, 35.0)), 2)
    turn = rotation_rpy(float(roll) * DEG, float(pitch) * DEG, yaw * DEG)
    return np.array([*flat.round(1), round(height, 1)]) * MM, turn


def _plans(rng: np.random.Generator, habits: Habits) -> tuple[Plan, ...]:
    """Draw conditions of three feed directions; the held-out ones are new combinations of known levels."""
    first = float(rng.choice([0.0, 90.0, 180.0, 270.0]))
    towards = (first, (first + 180.0) % 360.0, (first + float(rng.choice([90.0, 270.0]))) % 360.0)
    speeds = rng.choice(habits.rpm, int(rng.integers(1, 3)), replace=False)
    feeds = np.linspace(*habits.feed, 4) * np.exp(rng.uniform(-0.08, 0.08, 4))
    depths = np.linspace(*habits.axial, 3) * np.exp(rng.uniform(-0.1, 0.1, 3))
    radial = rng.uniform(*habits.radial, 2)
    plans: dict[str, Plan] = {}
    known = int(rng.integers(habits.identify[0], habits.identify[1] + 1))
    count = known + int(rng.integers(habits.validate[0], habits.validate[1] + 1))
    for _ in range(1000):
        if len(plans) == count:
            break
        at, rpm = len(plans), float(rng.choice(speeds))
        feed, depth = round(float(rng.choice(feeds)), 3), round(float(rng.choice(depths)), 1)
        wide, along = round(float(rng.choice(radial)), 1), towards[at % 3]
        which = "down" if rng.uniform() < 0.6 else "up"
        name = f"{which}-{rpm:g}-{depth:g}-{wide:g}-{feed:g}-{along:g}"
        role = "identify" if at < known else "validate"
        again = 2 if rng.uniform() < (0.6 if role == "identify" else 0.4) else 1
        plan = Plan(name, role, "side", rpm, feed, depth, wide, which, along, replicates=again)
        plans.setdefault(name, plan)
    return tuple(plans.values())


def _swaying(arm: Arm, bench: Bench, turn: Array) -> tuple[int, ...]:
    """Joints that the cut, which outweighs the arm there, pushes one way here and the other way there.

    Those on which that happens within a run, where there are any, else those on which it does between runs.
    """
    torques, weights, within = [], [], np.zeros(6, dtype=bool)
    for plan in bench.plans:
        wall, along = side(bench, way(plan)), bench.lines[way(plan)]
        feed = np.stack([wall.along, wall.across, [0.0, 0.0, 1.0]])
        force = full_cut(side_cut(bench, plan, bench.metal)) @ feed @ turn.T
        over = (along.s > entry(bench)) & (along.s < along.length - entry(bench))
        torques.append(np.array([arm.jacobian(q)[:3].T @ force for q in along.q[over]]))
        weights.append(np.array([arm.gravity(q) for q in along.q[over]]))
        within |= _both_ways(torques[-1] - weights[-1])
    cut, weight = np.vstack(torques), np.vstack(weights)
    light = np.median(np.abs(weight), axis=0) < 0.5 * np.median(np.abs(cut), axis=0)
    some = light & (within if (light & within).any() else _both_ways(cut - weight))
    return tuple(np.flatnonzero(some).tolist())


def _both_ways(torque: Array) -> np.ndarray:
    return np.asarray((torque.min(axis=0) < 0.0) & (torque.max(axis=0) > 0.0))
