"""Side cuts of an arm in the harder world: styles ``c`` and ``d`` of :mod:`virtual_cell.recipes.arm`.

One force of a run is what the dynamometer reads, what the motors carry and what bends the arm; see
:mod:`virtual_cell.world.arm.robot`. Cutter, spindle and dynamometer are those of ``side_force`` and
``record``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from virtual_cell.dynamometer import record
from virtual_cell.hidden import Parameters
from virtual_cell.recipes.arm_draws import Bench, Side, entry, side, side_cut, speed, way
from virtual_cell.recipes.arm_world_day import Session, in_plain_units
from virtual_cell.recipes.arm_world_programme import drawn
from virtual_cell.recipes.kr160 import DH, NEAR_DEG, TOOL_AXES
from virtual_cell.session import Plan, write_force
from virtual_cell.side_force import SideForce, side_force
from virtual_cell.units import DEG, MM, Array
from virtual_cell.wall import feed_marks
from virtual_cell.world.arm import told
from virtual_cell.world.arm.cause import During
from virtual_cell.world.arm.causes import ARM_CAUSES
from virtual_cell.world.arm.made import Made
from virtual_cell.world.arm.robot import Course, Done, Robot, Way, done, logged
from virtual_cell.world.arm.robot import way as statics
from virtual_cell.world.arm.terms import in_contract_terms
from virtual_cell.world.present import listed
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_signal, write_yaml

_ORBIT = 0.5  # radius of the orbit of a helical entry over that of the tool
_BEGIN = (10.5 * MM, 14.0 * MM)  # of the line, where the records begin


@dataclass(frozen=True, eq=False)
class _Run:
    """A cut as it is told (``plan``) and as it is made (``real``), its wall, its line, its place."""

    plan: Plan
    real: Plan
    wall: Side
    line: Way
    order: int

    @property
    def name(self) -> str:
        return f"r{self.order:02d}"

    @property
    def feed(self) -> Array:
        """Axes of the feed frame in the work frame, as rows (3, 3)."""
        return np.stack([self.wall.along, self.wall.across, np.array([0.0, 0.0, 1.0])])


@dataclass(frozen=True, eq=False)
class _Day:
    """All that a run is made on; ``seed`` of what causes draw anew in each run."""

    robot: Robot
    bench: Bench
    session: Session
    seed: int

    def course(self, run: _Run, begin: float, *, cutting: bool, start: Array) -> Course:
        """Return how a run is made."""
        at = self.session.cut_at(run.order) if cutting else self.session.idle_at(run.order)
        return Course(
            run.line,
            speed(self.bench, run.plan) * (1.0 + self.session.slow),
            begin,
            entry(self.bench),
            self.session.warming.at(at),
            start,
            self.robot.turn @ run.wall.normal,
            run.wall.length,
            turns=run.plan.spindle_rpm / 60.0,
            order=run.order,
            runs=len(self.session.runs),
            since=at,
            cutting=cutting,
            seed=self.seed,
        )


def make(
    folder: Path, hidden: Mapping[str, Parameters | None], seed: int, style: str, about: str = "joint_force"
) -> Row:
    """Write a batch that hides causes (name → parameters, or None: drawn by the seed); return the truth.

    ``about``: the observable of which the truth says what is always there.

    Raises
    ------
    KeyError
        For a cause that is not known.
    """
    rng = np.random.default_rng([seed, 41, ord(style)])
    robot, bench, session = drawn(rng, style)
    given = {name: values or ARM_CAUSES[name].draw(rng, robot) for name, values in hidden.items()}
    for name, values in given.items():
        robot = ARM_CAUSES[name].apply(robot, values)
    fresh_folder(folder)
    day = _Day(robot, bench, session, seed)
    lines = {wall: statics(robot, along) for wall, along in bench.lines.items()}
    rows, runs = _entries(day), []
    for order, (plan, replicate) in enumerate(session.runs, start=1):
        own = rng.spawn(5)
        wall = side(bench, way(plan))
        run = _Run(plan, session.cut(plan, own[0]), wall, lines[way(plan)], order)
        row, made = _made(day, run, folder, own)
        rows.append(_row(run, replicate, session.entries) | row)
        runs.append(made)
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    write_csv(folder / "loads.csv", tested(day, rng))
    write_yaml(folder / "cell.yaml", {"cell": "cutting-arm", "arm": {"dh": [list(row) for row in DH]}})
    write_yaml(folder / "batch.yaml", manifest(folder.name, day))
    cuts = [run.cut.during for run in runs]
    effects: Row = {}
    errors: Row = {}
    for name, values in given.items():
        cause = ARM_CAUSES[name]
        translate = cause.translate if isinstance(cause, Made) else None
        effects[name], error = translate(robot, cuts, values) if translate else (values, {})
        errors |= {name: error} if error else {}
    return {
        "batch": folder.name,
        "seed": seed,
        "style": style,
        "effects": effects,
        "translation_error": errors,
        "always_on": listed(in_contract_terms(about, robot, runs, _gauges(day)), effects),
        "turning": [joint + 1 for joint in robot.moves.turning],
        "world": in_plain_units(robot, bench, session),
    }


def _entries(day: _Day) -> list[Row]:
    """Rows of the holes that were milled on a helix before the runs: no file, but they count as cut."""
    tool, orbit = day.bench.tool, 2.0 * math.pi * _ORBIT * day.bench.tool.radius
    first = day.session.runs[0][0]
    feed = first.feed_per_tooth_mm * MM * tool.teeth * first.spindle_rpm
    return [
        {
            "run": f"h{order:02d}",
            "condition": "entry",
            "replicate": order,
            "order": order,
            "operation": "helical",
            "spindle_rpm": first.spindle_rpm,
            "feed_per_tooth_mm": first.feed_per_tooth_mm,
            "axial_depth_mm": 0.5,
            "direction": "slot",
            "orbit_rpm": round(feed / orbit, 3),
            "cut_length_mm": round(12.0 * orbit / MM, 2),
        }
        for order in range(1, day.session.entries + 1)
    ]


def _row(run: _Run, replicate: int, before: int) -> Row:
    plan = run.plan
    row: Row = {key: getattr(plan, key) for key in plan.__dataclass_fields__ if not key.endswith("_s")}
    row |= {"run": run.name, "replicate": replicate, "order": before + run.order, "pose": "p1"}
    return row | {"cut_length_mm": round(run.wall.length / MM, 3)}


def _gauges(day: _Day) -> told.Gauges:
    gains, stylus = day.bench.calibration, day.session.stylus
    return told.Gauges(gains[:3], float(gains[3]), stylus.noise, stylus.zero)


def _made(day: _Day, run: _Run, folder: Path, own: list[np.random.Generator]) -> tuple[Row, told.Run]:
    """Cut a run: force, logs and trace, each its own noise; return the files and what the arm did."""
    robot, session, (cutting, idling, sensing, logging, tracing) = day.robot, day.session, own
    force = _force(day, run, cutting)

    def in_base(x: Array) -> Array:
        return np.asarray(force.mean_at(x) @ run.feed @ robot.turn.T)

    begin = cutting.uniform(*_BEGIN)
    course = day.course(run, begin, cutting=True, start=cutting.uniform(-1.0, 1.0, 6))
    cut = done(robot, course, in_base)
    late = robot.clock_offset + cutting.normal(0.0, robot.recorder.slip)
    files = {"robot_log": f"robot/{run.name}-cut.parquet"}
    write_signal(folder / files["robot_log"], logged(robot, cut, course.warmth, logging, late=late))
    air, idle = None, 0.0
    if run.order not in session.without_idle:
        files["idle_log"] = f"robot/{run.name}-idle.parquet"
        free = day.course(run, idling.uniform(*_BEGIN), cutting=False, start=idling.uniform(-1.0, 1.0, 6))
        air, idle = done(robot, free, None), free.warmth
        write_signal(folder / files["idle_log"], logged(robot, air, free.warmth, idling, late=0.0))
    files["dynamometer"] = write_force(folder, run.name, *_sensed(day, run, force, cut.during, sensing))
    files["profile"] = f"profile/{run.name}.parquet"
    write_signal(folder / files["profile"], _traced(day, run, cut, tracing))
    return dict(files), told.Run(cut, air, late, (course.warmth, idle))


def _force(day: _Day, run: _Run, rng: np.random.Generator) -> SideForce:
    """Force of a cut whose radial depth is what the wall, which stands proud in mid-block, leaves of it."""
    robot, session = day.robot, day.session
    cut = side_cut(day.bench, run.real, session.metal(day.bench, run.order, rng))
    q = run.line.along.spline(0.5 * run.line.along.length)

    def give(mean: Array) -> float:
        moved = robot.gives(q, robot.turn @ (mean @ run.feed), in_cut=True)
        return float(moved @ robot.turn @ run.wall.normal)

    error, phase = session.slow + session.spindle * rng.standard_normal(), rng.uniform(0.0, 2.0 * math.pi)
    return side_force(cut, give, speed_error=error, phase=phase)


def _sensed(
    day: _Day, run: _Run, force: SideForce, during: During, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Return times (n,), s, and readings (n, 3), N, of the dynamometer."""
    sensor, first = day.bench.sensor, float(during.x[0] - during.t[0] * during.feed)

    def in_work(t: Array) -> Array:
        acting: Array = force.at(t, first + t * during.feed, sensor.rate) @ run.feed
        for cause in day.robot.causes:
            if cause.sensed is not None:
                acting = cause.sensed(during, t, acting)
        return np.asarray(acting * (1.0 + day.bench.calibration[:3]))

    return record(sensor, in_work, float(during.t[-1]), rng)


def _traced(day: _Day, run: _Run, cut: Done, rng: np.random.Generator) -> dict[str, Array]:
    """Trace of the wall: what the tip left, marks of the teeth, and what the instrument makes of it."""
    stylus = day.session.stylus
    x = stylus.places(run.wall.length)
    z: Array = cut.height(x) + feed_marks(x, run.plan.feed_per_tooth_mm * MM, day.bench.tool, rng.uniform())
    for cause in day.robot.causes:
        if cause.traced is not None:
            z = cause.traced(cut.during, x, z)
    return stylus.read(x, z, rng)


def tested(day: _Day, rng: np.random.Generator) -> list[Row]:
    """Pull and push the tip along the work's axes at two levels, in each pose, under a laser tracker."""
    robot, bench = day.robot, day.bench
    over = np.array([0.5 * bench.size[0], 0.5 * bench.size[1], 0.0]) @ robot.turn.T + robot.origin
    poses = {"p1": robot.arm.reach(over, robot.turn, np.array(NEAR_DEG) * DEG), **bench.poses}
    rows = []
    for pose, q in poses.items():
        place = robot.arm.pose(q)[0]
        at = (place - robot.origin) @ robot.turn
        for axis, level, sign in ((a, n, s) for a in range(3) for n in bench.loads for s in (1.0, -1.0)):
            for replicate in range(1, bench.repeats + 1):
                force = sign * level * np.eye(3)[axis]
                real = robot.turn @ force * (1.0 + day.bench.calibration[3])
                moved = robot.gives(q, real, in_cut=False)
                read = _looked_at(day, (place, moved, real), rng) @ robot.turn
                row: Row = {"pose": pose, "point": "tip"}
                row |= {f"q{i}_deg": float(q[i - 1] / DEG) for i in range(1, 7)}
                row |= {f"{name}_mm": round(float(at[i] / MM), 3) for i, name in enumerate("xyz")}
                row |= {f"f{name}_n": float(force[i]) for i, name in enumerate("xyz")}
                row |= {f"d{name}_mm": round(float(read[i] / MM), 4) for i, name in enumerate("xyz")}
                rows.append(row | {"replicate": replicate})
    return rows


def _looked_at(day: _Day, test: tuple[Array, Array, Array], rng: np.random.Generator) -> Array:
    """Read a displacement (3,), m, once more where it goes against its load: people look at that.

    ``test``: place of the tip, how it moved, and the force, each (3,) in the base.
    """
    place, moved, force = test
    for _ in range(20):
        read = day.session.tracker.read(place, moved, rng)
        if read @ force > 0.25 * moved @ force:
            break
    return read


def manifest(name: str, day: _Day) -> Row:
    """Return batch.yaml: what the people who measured say."""
    robot, bench, tool, sensor = day.robot, day.bench, day.bench.tool, day.bench.sensor
    hole = round(2.0 * (1.0 + _ORBIT) * tool.radius / MM, 6)
    pitch = -math.asin(robot.turn[2, 0])
    roll = math.atan2(robot.turn[2, 1], robot.turn[2, 2])
    yaw = math.atan2(robot.turn[1, 0], robot.turn[0, 0])
    return {
        "format": 1,
        "batch": name,
        "title": f"Side cuts of an arm, {tool.teeth}-tooth {2.0 * tool.radius / MM:g} mm end mill",
        "source": "simulated",
        "cell": "cutting-arm",
        "tool": {
            "diameter_mm": round(2.0 * tool.radius / MM, 6),
            "teeth": tool.teeth,
            "helix_deg": round(tool.helix / DEG, 6),
            "pitch_deg": [round(360 / tool.teeth)] * tool.teeth,
        },
        "tool_in_flange_mm": [round(float(v) / MM, 6) for v in robot.arm.tip],
        "tool_axes_in_flange": [list(row) for row in TOOL_AXES],
        "work": {"material": "AA6061-T6", "size_mm": [round(v / MM, 6) for v in bench.size]},
        "work_in_base": {
            "xyz_mm": [round(float(v) / MM, 6) for v in robot.origin],
            "rpy_deg": [round(angle / DEG, 6) for angle in (roll, pitch, yaw)],
        },
        **({"hole_diameter_mm": hole} if day.session.entries else {}),
        "instruments": {
            "dynamometer": {
                "rate_hz": sensor.rate,
                "reads": sensor.reads,
                "axes": dict(bench.axes),
                "rotation_deg": 0,
                "range_n": sensor.capacity,
                "noise_n": sensor.noise,
            },
            "robot_log": {
                "period_ms": robot.recorder.period * 1e3,
                "torque_noise_nm": robot.recorder.torque_noise,
            },
            "profiler": {
                "spacing_mm": round(day.session.stylus.step / MM, 6),
                "sigma_mm": round(day.session.stylus.noise / MM, 6),
            },
        },
    }
