"""Side cuts of an arm for blind tests: force, torques and wall of every run, and load tests of its joints.

What is hidden is a field of the cell; force on the tool, torques, deflection and wall of a run are made from
one force. The work's zero is touched off with the tool that cuts, so that a tip that is declared wrong moves
no wall.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from virtual_cell.arm_cell import ArmCell
from virtual_cell.arm_effects import ARM_EFFECTS
from virtual_cell.arm_line import given_way, statics, under_load
from virtual_cell.arm_log import Pass, cut_log, idle_log
from virtual_cell.arm_wall import height
from virtual_cell.dynamometer import record
from virtual_cell.hidden import Parameters
from virtual_cell.milling import scattered
from virtual_cell.recipes import arm_world
from virtual_cell.recipes.arm_draws import Bench, Side, drawn, entry, side, side_cut, speed, way
from virtual_cell.recipes.arm_world_programme import HABITS
from virtual_cell.recipes.kr160 import DH, NEAR_DEG, TOOL_AXES
from virtual_cell.session import Plan, spread, write_force
from virtual_cell.side_force import SideForce, side_force
from virtual_cell.units import DEG, MM, Array
from virtual_cell.wall import feed_marks, trace
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_signal, write_yaml

_SCATTER, _SPEED_ERROR = 0.01, 0.005
_BEGIN = (7.0 * MM, 11.0 * MM)  # of the line, where the records begin
_APART = 180.0  # s, from run to run
_GRID = 0.05 * MM  # of the stylus
CELL: Row = {"cell": "cutting-arm", "arm": {"dh": [list(row) for row in DH]}}


@dataclass(frozen=True)
class _Run:
    """One side cut: the cell and the bench as they are, its settings, its wall, its pass, its place."""

    cell: ArmCell
    bench: Bench
    plan: Plan
    wall: Side
    one: Pass
    order: int

    @property
    def entry(self) -> float:
        """Length of the line, m, at which the axis is over the face where the tool enters."""
        return entry(self.bench)

    @property
    def feed(self) -> Array:
        """Axes of the feed frame in the work frame, as rows (3, 3)."""
        return np.stack([self.wall.along, self.wall.across, np.array([0.0, 0.0, 1.0])])


def make(
    folder: Path,
    hidden: Mapping[str, Parameters | None],
    seed: int,
    style: str = "a",
    *,
    about: str = "joint_force",
) -> Row:
    """Write a batch that hides effects (name → parameters, or None: drawn by the seed); return the truth.

    Styles ``c`` and ``d`` are of the harder world, :mod:`virtual_cell.recipes.arm_world`, in which there is
    always a little of some effects: the truth says what an observable, ``about``, reads of them.

    Raises
    ------
    KeyError
        For an effect that is not known.
    """
    if style in HABITS:
        return arm_world.make(folder, hidden, seed, style, about)
    rng = np.random.default_rng([seed, 23])
    cell, bench = drawn(rng, style)
    effects = {name: given or ARM_EFFECTS[name].draw(rng, cell) for name, given in hidden.items()}
    for name, parameters in effects.items():
        cell = ARM_EFFECTS[name].apply(cell, parameters)
    fresh_folder(folder)
    rows, _ = cut_all(folder, cell, bench, rng)
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    write_csv(folder / "loads.csv", tested(cell, bench, rng))
    write_yaml(folder / "cell.yaml", CELL)
    write_yaml(folder / "batch.yaml", manifest(folder.name, cell, bench))
    return {
        "batch": folder.name,
        "seed": seed,
        "style": style,
        "effects": effects,
        "turning": [joint + 1 for joint in cell.moves.turning],
    }


def cut_all(
    folder: Path, cell: ArmCell, bench: Bench, rng: np.random.Generator
) -> tuple[list[Row], dict[str, Row]]:
    """Cut and record every run of a bench into ``folder``; return the rows of the run table, and the truth.

    The truth, by run: ``force_n``, the mean on the tool in full cut (3,), work frame, and ``mm_per_n`` (3,),
    by how much the wall is higher for more of it.
    """
    loads = {wall: statics(cell, along) for wall, along in bench.lines.items()}
    rows, truth = [], {}
    for place, (plan, replicate) in enumerate(spread(bench.plans, rng), start=1):
        name, noise, where = f"r{place:02d}", rng.spawn(5), way(plan)
        one = Pass(bench.lines[where], loads[where], speed(bench, plan), noise[0].uniform(*_BEGIN))
        run = _Run(cell, bench, plan, side(bench, where), one, place)
        force = _force(run, noise[0])
        rows.append(_row(run, name, replicate) | _recorded(run, force, folder, name, noise[1:]))
        truth[name] = _true(run, force)
    return rows, truth


def _true(run: _Run, force: SideForce) -> Row:
    mean = force.turn.mean(axis=0) @ run.feed
    middle = np.array([0.5 * run.one.along.length])

    def stands(newtons: Array) -> float:
        moved = given_way(run.cell, run.one.loads, middle, (run.cell.turn @ newtons)[None])[0]
        return float(moved @ run.cell.turn @ run.wall.normal)

    slope = [(stands(mean + step) - stands(mean - step)) / 2.0 for step in np.eye(3)]
    return {"force_n": mean.tolist(), "mm_per_n": [value / MM for value in slope]}


def _row(run: _Run, name: str, replicate: int) -> Row:
    plan = run.plan
    row: Row = {key: getattr(plan, key) for key in plan.__dataclass_fields__ if not key.endswith("_s")}
    row |= {"run": name, "replicate": replicate, "order": run.order, "pose": "p1"}
    return row | {"cut_length_mm": round(run.wall.length / MM, 3)}


def _recorded(
    run: _Run, force: SideForce, folder: Path, name: str, noise: Sequence[np.random.Generator]
) -> Row:
    """Record a side cut and its idle run: both logs, the force, the trace of the wall, each its own noise."""
    cell, bench, one = run.cell, run.bench, run.one
    idling, cutting, sensing, tracing = noise

    def in_base(s: Array) -> Array:
        return np.asarray(force.mean_at(s - run.entry) @ run.feed @ cell.turn.T)

    def in_work(t: Array) -> Array:
        x = one.begin + t * one.speed - run.entry
        gain = (1.0 + cell.gain_drift * np.maximum(t, 0.0))[:, None] * (1.0 + bench.calibration[:3])
        return np.asarray(force.at(t, x, bench.sensor.rate) @ run.feed * gain)

    idle = replace(one, begin=idling.uniform(*_BEGIN))
    files = {"idle_log": f"robot/{name}-idle.parquet", "robot_log": f"robot/{name}-cut.parquet"}
    write_signal(folder / files["idle_log"], idle_log(cell, idle, bench.period, idling))
    write_signal(folder / files["robot_log"], cut_log(cell, one, in_base, bench.period, cutting))
    time, read = record(bench.sensor, in_work, one.seconds(), sensing)
    files |= {"dynamometer": write_force(folder, name, time, read), "profile": f"profile/{name}.parquet"}
    write_signal(folder / files["profile"], _traced(run, in_base, tracing))
    return dict(files)


def _force(run: _Run, rng: np.random.Generator) -> SideForce:
    """Force of a cut whose radial depth is what the wall, which stands proud in mid-block, leaves of it."""
    cut = side_cut(run.bench, run.plan, scattered(run.bench.metal, _SCATTER, rng))
    middle = np.array([0.5 * run.one.along.length])

    def give(mean: Array) -> float:
        force = mean @ run.feed @ run.cell.turn.T
        moved = given_way(run.cell, run.one.loads, middle, force[None])[0]
        return float(moved @ run.cell.turn @ run.wall.normal)

    error, phase = _SPEED_ERROR * rng.uniform(-1.0, 1.0), rng.uniform(0.0, 2.0 * math.pi)
    return side_force(cut, give, speed_error=error, phase=phase)


def _traced(run: _Run, in_base: Callable[[Array], Array], rng: np.random.Generator) -> dict[str, Array]:
    """Trace of the wall: how far it stands proud, feed marks, the stylus's noise and its zero."""
    x = np.arange(0.5 * MM, run.wall.length - 1.0 * MM, _GRID)
    normal = run.cell.turn @ run.wall.normal
    z = height(run.cell, run.one, in_base, normal, x, entry=run.entry, seconds=_APART * run.order)
    z = z + feed_marks(x, run.plan.feed_per_tooth_mm * MM, run.bench.tool, rng.uniform())
    z = z + rng.normal(0.0, run.bench.zero)
    return trace(x, z, run.bench.stylus, rng)


def tested(cell: ArmCell, bench: Bench, rng: np.random.Generator) -> list[Row]:
    """Pull and push the tip along the work's axes at two levels, in each pose."""
    over = cell.in_base(np.array([0.5 * bench.size[0], 0.5 * bench.size[1], 0.0]))
    poses = {"p1": cell.arm.reach(over, cell.turn, np.array(NEAR_DEG) * DEG), **bench.poses}
    rows = []
    for pose, q in poses.items():
        at = (cell.arm.pose(q)[0] - cell.origin) @ cell.turn
        for axis, level, sign in ((a, n, s) for a in range(3) for n in bench.loads for s in (1.0, -1.0)):
            for replicate in range(1, bench.repeats + 1):
                force = sign * level * np.eye(3)[axis]
                real = force * (1.0 + bench.calibration[3])
                moved = under_load(cell, q, cell.turn @ real) @ cell.turn
                moved = moved + rng.normal(0.0, bench.tracker, 3)
                row: Row = {"pose": pose, "point": "tip"}
                row |= {f"q{i}_deg": float(q[i - 1] / DEG) for i in range(1, 7)}
                row |= {f"{name}_mm": round(float(at[i] / MM), 3) for i, name in enumerate("xyz")}
                row |= {f"f{name}_n": float(force[i]) for i, name in enumerate("xyz")}
                row |= {f"d{name}_mm": round(float(moved[i] / MM), 4) for i, name in enumerate("xyz")}
                rows.append(row | {"replicate": replicate})
    return rows


def manifest(name: str, cell: ArmCell, bench: Bench) -> Row:
    """Return batch.yaml of a batch of side cuts."""
    tool, sensor = bench.tool, bench.sensor
    yaw = math.atan2(cell.turn[1, 0], cell.turn[0, 0]) / DEG
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
        "tool_in_flange_mm": [round(float(v) / MM, 6) for v in cell.arm.tip],
        "tool_axes_in_flange": [list(row) for row in TOOL_AXES],
        "work": {"material": "AA6061-T6", "size_mm": [round(v / MM, 6) for v in bench.size]},
        "work_in_base": {
            "xyz_mm": [round(float(v) / MM, 6) for v in cell.origin],
            "rpy_deg": [0, 0, round(yaw, 6)],
        },
        "instruments": {
            "dynamometer": {
                "rate_hz": sensor.rate,
                "reads": sensor.reads,
                "axes": dict(bench.axes),
                "rotation_deg": 0,
                "range_n": sensor.capacity,
                "noise_n": sensor.noise,
            },
            "robot_log": {"period_ms": bench.period * 1e3, "torque_noise_nm": cell.drives.torque_noise},
            "profiler": {"spacing_mm": 0.05, "sigma_mm": bench.stylus / MM},
        },
    }
