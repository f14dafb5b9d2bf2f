"""A cutting arm of the harder world: what it does on a line, in the air or in the cut, and under a load.

Its joints, gears, hoses, links and controller are modules of their own; here they act on one another. The
links feel gravity, the cut, and a small part of the friction; springs and gaps give way to that; motors
carry it through gears whose errors modulate it, with most of the friction; the servos stray by what changes;
and the tip follows all of it through the modes of the structure.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from virtual_cell.arm import Arm
from virtual_cell.arm_cell import Moves
from virtual_cell.arm_line import Line
from virtual_cell.units import Array
from virtual_cell.world.arm.cause import Cause, During
from virtual_cell.world.arm.controller import Recorder, Servo
from virtual_cell.world.arm.gears import Springs, Transmission
from virtual_cell.world.arm.hose import Hose
from virtual_cell.world.arm.joints import Joints
from virtual_cell.world.arm.links import Links

STEP = 1.0 / 450.0  # s: a tenth of the period of the highest mode, and less


@dataclass(frozen=True, eq=False)
class Robot:
    """The truth of an arm.

    Attributes
    ----------
    arm : as it is declared. tip_offset : (3,) true tip less the declared one, flange frame, m.
    origin, turn : of the work in the base, (3,) m and (3, 3). moves : how the joints move in the cuts.
    clock_offset : s, by how much later the log of a cut stamps an event than the dynamometer.
    causes : that are hidden and no property of one of the parts.
    """

    arm: Arm
    origin: Array
    turn: Array
    moves: Moves
    joints: Joints
    springs: Springs
    transmission: Transmission
    hose: Hose
    links: Links
    servo: Servo
    recorder: Recorder
    tip_offset: tuple[float, ...] = (0.0, 0.0, 0.0)
    clock_offset: float = 0.0
    causes: tuple[Cause, ...] = ()

    @cached_property
    def true(self) -> Arm:
        """The arm with the tip where it really is."""
        return replace(self.arm, tip=self.arm.tip + np.array(self.tip_offset))

    def with_cause(self, cause: Cause) -> Robot:
        """Return it with one more hidden cause."""
        return replace(self, causes=(*self.causes, cause))

    def gives(self, q: Array, force: Array, *, in_cut: bool) -> Array:
        """Displacement (3,), m, of the tip at joint angles (6,) under a steady force (3,), N, base frame."""
        linear, held = self.true.jacobian(q)[:3], -self.arm.gravity(q)
        twist = self.springs.in_cut if in_cut else self.springs.elastic
        # a load test is held for seconds, pulled from below: its lost motion is on the side of the load
        lost = self.springs.lost * (np.tanh((linear.T @ force) / self.springs.turning))
        joints = twist(held + linear.T @ force) - twist(held) + lost
        return np.asarray(linear @ joints + self.links.compliance(self.true, q) @ force)

    def total(self, name: str, during: During) -> Array:
        """Sum of what the causes add under one name; zero where none does."""
        width = 3 if name == "tip" else 6
        parts = [getattr(one, name)(during) for one in self.causes if getattr(one, name) is not None]
        return np.sum(parts, axis=0) if parts else np.zeros((len(during.t), width))


@dataclass(frozen=True, eq=False)
class Way:
    """A line with what the arm is on it, as splines over its length."""

    along: Line
    jacobian: Any
    gravity: Any
    rest: Any


def way(robot: Robot, along: Line) -> Way:
    """Return a line with the statics of an arm."""
    from scipy.interpolate import CubicSpline

    columns = [
        [robot.true.jacobian(q)[:3] for q in along.q],
        [robot.arm.gravity(q) for q in along.q],
        [robot.links.compliance(robot.true, q) for q in along.q],
    ]
    return Way(along, *(CubicSpline(along.s, np.array(values)) for values in columns))


@dataclass(frozen=True, eq=False)
class Course:
    """How a line is run: ``speed`` m/s; ``begin`` m of the line at which the records begin.

    ``entry`` m of the line at which the axis is over the face of the block. ``warmth`` of the joints.
    ``start`` (6,) −1 … 1: what the last motion left of the hoses' drag. The rest as in :class:`During`.
    """

    way: Way
    speed: float
    begin: float
    entry: float
    warmth: float
    start: Array
    normal: Array
    length: float
    turns: float
    order: int
    runs: int
    since: float
    cutting: bool
    seed: int


@dataclass(frozen=True, eq=False)
class Done:
    """What an arm did: ``torque`` (n, 6) N m of the motors, ``strayed`` (n, 6) rad as the encoders have it.

    ``tip`` (n, 3) m, base frame: where the tip is against the line, by all that moved it. ``outside`` (n, 6)
    N m: of the cut and the weight, on the links.
    """

    during: During
    outside: Array
    torque: Array
    strayed: Array
    tip: Array

    def height(self, x: Array) -> Array:
        """How far (k,), m, the wall stands proud at places ``x`` (k,), m, from its face."""
        return np.interp(x, self.during.x, self.tip @ self.during.normal)


def done(robot: Robot, course: Course, force: Callable[[Array], Array] | None) -> Done:
    """Run a line; ``force(x)`` (n, 3), N, base frame, acts on the tip with the axis at places ``x``, m."""
    during = _during(robot, course, force)
    gravity, rest = course.way.gravity(_lengths(course, during)), course.way.rest(_lengths(course, during))
    outside = during.torque - gravity
    friction, sliding = robot.joints.friction(during.rate, outside, during.dt, course.warmth)
    during = replace(during, sliding=sliding)
    resisting = robot.joints.behind * friction + robot.total("load", during)
    links = outside - resisting
    motors = -links * (1.0 + robot.transmission.slope(during.q))
    motors = motors + (1.0 - robot.joints.behind) * friction + robot.hose.torque(during.q, course.start)
    motors = motors + robot.total("drive", during)
    strayed = robot.servo.strayed(motors, during.rate, during.dt)
    twist = (
        robot.springs.in_cut(links) + robot.springs.hysteresis(links) + robot.springs.rattle(links, during.dt)
    )
    error = robot.transmission.error(during.q, sliding) - robot.servo.misread(during.q)
    # The work was touched off in mid-wall, under the arm's own weight and from both sides of any gap.
    middle = int(np.argmin(np.abs(during.x - 0.5 * during.length)))
    weight = robot.springs.in_cut(-gravity)
    joints = twist - weight[middle] + error - error[middle] + strayed
    tip = np.einsum("nai,ni->na", during.jacobian, joints) + np.einsum("nab,nb->na", rest, during.force)
    tip = robot.links.followed(tip, during.dt) + robot.total("tip", during)
    return Done(during, outside, motors, strayed, tip)


def _lengths(course: Course, during: During) -> Array:
    return np.asarray(during.x + course.entry)


def _during(robot: Robot, course: Course, force: Callable[[Array], Array] | None) -> During:
    """Return what is known of a run before anything gives way; friction is not known yet."""
    along = course.way.along
    t = np.arange(0.0, along.length / course.speed, STEP)
    s = t * course.speed
    x, q = s - course.entry, np.asarray(along.spline(s))
    jacobian = np.asarray(course.way.jacobian(s))
    acting = np.zeros((len(t), 3)) if force is None else force(x)
    size = np.linalg.norm(acting, axis=1)
    first, last = (robot.true.pose(along.q[i])[0] for i in (0, -1))
    return During(
        t=t - course.begin / course.speed,
        x=x,
        q=q,
        rate=along.rate(s, course.speed),
        sliding=np.zeros_like(q),
        force=acting,
        torque=np.einsum("nai,na->ni", jacobian, acting),
        engaged=size / max(float(size.max()), 1e-9),
        jacobian=jacobian,
        normal=course.normal,
        along=(last - first) / np.linalg.norm(last - first),
        length=course.length,
        feed=course.speed,
        turns=course.turns,
        order=course.order,
        runs=course.runs,
        since=course.since,
        cutting=course.cutting,
        seed=course.seed,
    )


def logged(
    robot: Robot, run: Done, warmth: float, rng: np.random.Generator, *, late: float
) -> dict[str, Array]:
    """Log of a run, columns of the contract; its clock stamps an event ``late`` s later than it was."""
    recorder, during = robot.recorder, run.during
    due, stamp = recorder.arrivals(float(during.t[-1]) - abs(late) - 2.0 * recorder.period, rng)
    at = due * (1.0 - recorder.skew) - late

    def then(values: Array) -> Array:
        return np.stack([np.interp(at, during.t, one) for one in values.T], axis=1)

    torque = run.torque
    for cause in robot.causes:
        if cause.logged is not None:
            torque = cause.logged(during, torque)
    columns = {"t_s": stamp, **recorder.angles(then(during.q), then(run.strayed), rng)}
    read = recorder.read(then(torque), warmth, rng)
    return columns | {f"tau{i}_nm": read[:, i - 1] for i in range(1, 7)}
