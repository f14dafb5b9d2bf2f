"""kr160-side: side milling of aluminium with a robot that is softer in the cut than in its load tests."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from virtual_cell.arm import Arm, rotation_rpy
from virtual_cell.chips import Engagement, Tool
from virtual_cell.dynamometer import Dynamometer, record
from virtual_cell.milling import Cut, forces, scattered
from virtual_cell.motion import Straight
from virtual_cell.recipes.slot import ALUMINIUM
from virtual_cell.robot import Drives, log, straight_path, tip_error
from virtual_cell.robot import Path as RobotPath
from virtual_cell.session import Plan, Session, record_run, row_of, spread, write_force
from virtual_cell.units import DEG, MM, RPM, UM, Array
from virtual_cell.wall import feed_marks, settled, trace
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_signal, write_yaml

FACTOR = 0.5
RUNOUT_UM, RUNOUT_DEG = 7.35, 40.0
DH = (
    *((0, 90, 500, 250), (90, 0, 0, 610), (-180, -90, 0, 70)),
    *((0, 90, 710, 0), (0, -90, 0, 0), (0, 0, 215, 0)),
)
TIP_MM = (212.5, 0.0, 279.91)
TOOL_AXES = ((0, 0, -1), (0, -1, 0), (-1, 0, 0))
ARM = Arm(
    np.array(DH, dtype=float),
    np.array(TIP_MM) * MM,
    np.array(TOOL_AXES, dtype=float),
    np.array([1.83e6, 2.12e6, 1.34e6, 3.1e5, 3.9e5, 2.3e5]),
    np.array([0.0, 190.0, 70.0, 90.0, 25.0, 45.0]),
)
DRIVES = Drives(
    coulomb=np.array([160.0, 190.0, 130.0, 45.0, 38.0, 26.0]),
    viscous=np.array([900.0, 1100.0, 700.0, 160.0, 140.0, 90.0]),
    lag=0.004,
    reversal=np.array([0.0, 0.0, 0.0, 4e-5, 4e-5, 1.6e-4]),
    ripple=np.array([1e-6, 1e-6, 1e-6, 6e-6, 6e-6, 1.5e-5]),
    ripple_order=np.array([450.0, 450.0, 420.0, 600.0, 600.0, 900.0]),
    torque_noise=3.0,
)
WORK_MM, YAW_DEG = (1510.0, -210.0, 590.0), 190.0
SIZE_MM = (100.0, 60.0, 30.0)
NEAR_DEG = (-20.3, -13.9, -4.4, -61.7, 34.9, 56.7)  # joint angles that bring the tip near the block
LOAD_POSES_DEG = {
    "p2": (15.0, -25.0, 20.0, 30.0, 45.0, -20.0),
    "p3": (-35.0, -5.0, 5.0, -40.0, -50.0, 60.0),
    "p4": (5.0, -40.0, 45.0, 70.0, 30.0, 15.0),
    "p5": (40.0, 10.0, -20.0, -15.0, 60.0, -75.0),
}
_WORK = rotation_rpy(0.0, 0.0, YAW_DEG * DEG)
SOFT = replace(ARM, stiffness=ARM.stiffness * FACTOR)  # the arm in the cut
_LEAD = 12.0 * MM  # of the path before and after the tool is over the block
_PER_TURN = 48


def _slot(role: str, feed: float) -> Plan:
    return Plan(
        f"slot-{feed:g}", role, "slot", 4000.0, feed, 3.0, 16.0, cut_length_mm=SIZE_MM[0], replicates=2
    )


def _side(role: str, direction: str, depth: float, feed: float) -> Plan:
    name = f"{direction}-{depth:g}-{feed:g}"
    return Plan(
        name, role, "side", 4000.0, feed, depth, 4.0, direction, cut_length_mm=SIZE_MM[0], replicates=2
    )


PLANS = (
    *(_slot("identify", feed) for feed in (0.04, 0.06, 0.09)),
    _slot("validate", 0.075),
    *(_side("identify", "down", depth, feed) for depth, feed in ((3.0, 0.06), (5.0, 0.06), (3.0, 0.1))),
    _side("identify", "up", 3.0, 0.08),
    _side("validate", "down", 5.0, 0.09),
    _side("validate", "up", 5.0, 0.07),
)


def make(folder: Path) -> Row:
    """Write the batch; return the truth."""
    rng = np.random.default_rng(2603)
    tool = Tool(8.0 * MM, 35.0 * DEG, np.arange(3) * 120.0 * DEG, RUNOUT_UM * UM, RUNOUT_DEG * DEG)
    axes = -np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    session = Session(tool, ALUMINIUM, Dynamometer(4096.0, "work", axes, noise=1.5, step=0.5))
    fresh_folder(folder)
    rows = []
    for place, (plan, replicate) in enumerate(spread(PLANS, rng), start=1):
        row = row_of(session, plan, f"r{place:02d}", place, replicate) | {"pose": "p1"}
        if plan.operation == "slot":
            row["dynamometer"] = record_run(session, plan, folder, row["run"], metres=0.0, rng=rng)
        else:
            row |= _side_run(session, plan, folder, row, rng)
        rows.append(row)
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    write_csv(folder / "loads.csv", _loads(rng))
    write_yaml(folder / "cell.yaml", {"cell": "kr160", "arm": {"dh": [list(row) for row in DH]}})
    write_yaml(folder / "batch.yaml", _manifest(folder.name))
    return {"batch": folder.name, "effects": {"stiffness_scale": {"factor": FACTOR, "joint": "all"}}}


def _base(point: Array) -> Array:
    """Points (…, 3), m, of the work frame in the base frame."""
    moved: Array = point @ _WORK.T + np.array(WORK_MM) * MM
    return moved


@dataclass(frozen=True)
class _Pass:
    """One side cut of the arm.

    ``path``, whose start is at ``first`` (work x, m); the cut's records begin at length ``begin``, m, of it;
    ``inward`` is the sign of y into the material.
    """

    path: RobotPath
    first: float
    begin: float
    inward: float

    @property
    def start(self) -> float:
        """Position of the axis (work x, m) at the start of the cut's records."""
        return self.first + self.begin


def _side_run(session: Session, plan: Plan, folder: Path, row: Row, rng: np.random.Generator) -> Row:
    """One side cut and its idle run: logs, profile; the first of a condition on the dynamometer."""
    run = row["run"]
    way = _pass(session, plan, rng)
    cut = _deepened(session, plan, way, rng)
    x, force = _mean_force(cut, way)
    turned = force @ _WORK.T

    def in_base(s: Array) -> Array:
        at = s + way.first
        return np.stack([np.interp(at, x, part, left=0.0, right=0.0) for part in turned.T], axis=1)

    files = {"idle_log": f"robot/{run}-idle.parquet", "robot_log": f"robot/{run}-cut.parquet"}
    idle_begin = rng.uniform(0.0, 4.0 * MM)
    write_signal(folder / files["idle_log"], log(ARM, DRIVES, way.path, None, rng, begin=idle_begin))
    write_signal(folder / files["robot_log"], log(ARM, DRIVES, way.path, in_base, rng, begin=way.begin))
    if row["replicate"] == 1:
        duration = (way.path.s[-1] - way.begin) / way.path.speed
        time, read = record(session.dynamometer, lambda t: forces(cut, t), duration, rng)
        files["dynamometer"] = write_force(folder, run, time, read)
    files["profile"] = f"profile/{run}.parquet"
    write_signal(folder / files["profile"], _wall(session, plan, way, in_base, rng))
    return dict(files)


def _pass(session: Session, plan: Plan, rng: np.random.Generator) -> _Pass:
    """Path of one side cut along the block's near (up) or far (down) side."""
    inward = 1.0 if plan.direction == "up" else -1.0  # direction of y into the material
    free = 0.0 if plan.direction == "up" else SIZE_MM[1] * MM
    radius, z = session.tool.radius, -plan.axial_depth_mm * MM
    axis_y = free + inward * (plan.radial_depth_mm * MM - radius)
    ends = np.array([[-_LEAD - radius, axis_y, z], [SIZE_MM[0] * MM + _LEAD + radius, axis_y, z]])
    speed = plan.feed_per_tooth_mm * MM * session.tool.teeth * plan.spindle_rpm / 60.0
    path = straight_path(ARM, (_base(ends[0]), _base(ends[1])), _WORK, speed, np.array(NEAR_DEG) * DEG)
    return _Pass(path, float(ends[0, 0]), rng.uniform(0.0, 4.0 * MM), inward)


def _deepened(session: Session, plan: Plan, way: _Pass, rng: np.random.Generator) -> Cut:
    """Return the cut at the radial depth that the deflected arm gives it, in balance in mid-block."""
    spindle = plan.spindle_rpm * RPM * (1.0 + session.speed_error * rng.uniform(-1.0, 1.0))
    coefficients = scattered(session.coefficients, session.scatter, rng)
    edge, phase = session.tool.radius - plan.radial_depth_mm * MM, rng.uniform(0.0, 2.0 * math.pi)
    middle = way.path.at(way.path.s[-1:] / 2.0)[0]
    t = (0.5 * SIZE_MM[0] * MM - way.start) / way.path.speed + np.arange(
        20 * _PER_TURN
    ) / _PER_TURN * 60.0 / 4000.0
    deeper = 0.0
    for _ in range(5):
        motion = Straight(way.path.speed, way.start, SIZE_MM[0] * MM, plan.direction, edge - deeper)
        cut = Cut(Engagement(session.tool, motion, spindle, phase, plan.axial_depth_mm * MM), coefficients)
        moved = _WORK.T @ SOFT.yields(middle, _WORK @ forces(cut, t).mean(axis=0))
        deeper = way.inward * float(moved[1])
    return cut


def _mean_force(cut: Cut, way: _Pass) -> tuple[Array, Array]:
    """Positions (n,), m, of the axis from the block's face, and force (n, 3), N, averaged over a turn."""
    turn = 2.0 * math.pi / cut.engagement.spindle
    count = math.ceil((SIZE_MM[0] * MM - way.start) / way.path.speed / turn)
    t = np.arange(count * _PER_TURN) * (turn / _PER_TURN)
    middle = t.reshape(count, _PER_TURN).mean(axis=1)
    mean = forces(cut, t).reshape(count, _PER_TURN, 3).mean(axis=1)
    return cut.engagement.motion.centre(middle)[0], mean


def _wall(
    session: Session, plan: Plan, way: _Pass, in_base: Callable[[Array], Array], rng: np.random.Generator
) -> dict[str, Array]:
    """Trace of the wall: deflection, tracking errors and feed marks, out of the material."""
    path, on_path = way.path, way.path.s + way.first
    static = np.array([SOFT.yields(q, f) for q, f in zip(path.q, in_base(path.s), strict=True)]) @ _WORK
    off_track = tip_error(ARM, DRIVES, path, path.s) @ _WORK
    along = np.arange(on_path[0], SIZE_MM[0] * MM - 1.0 * MM, 0.05 * MM)
    deflected = settled(along, np.interp(along, on_path, static[:, 1]), path.speed)
    height = -way.inward * (deflected + np.interp(along, on_path, off_track[:, 1]))
    height += feed_marks(along, plan.feed_per_tooth_mm * MM, session.tool, rng.uniform())
    traced = along > 0.5 * MM
    return trace(along[traced], height[traced], 0.5 * UM, rng)


def _loads(rng: np.random.Generator) -> list[Row]:
    """Weights pulled at the tip along the work axes in five poses, displacement by a tracker (5 µm)."""
    over = _base(np.array([50.0, 30.0, 0.0]) * MM)
    poses = {"p1": ARM.reach(over, _WORK, np.array(NEAR_DEG) * DEG)}
    poses |= {pose: np.array(angles) * DEG for pose, angles in LOAD_POSES_DEG.items()}
    rows = []
    for pose, q in poses.items():
        at = (ARM.pose(q)[0] - np.array(WORK_MM) * MM) @ _WORK
        for axis in range(3):
            for newton in (300.0, -300.0, 600.0):
                for replicate in (1, 2):
                    force = newton * np.eye(3)[axis]
                    moved = ARM.yields(q, _WORK @ force) @ _WORK + rng.normal(0.0, 5.0 * UM, 3)
                    row: Row = {"pose": pose, "point": "tip"}
                    row |= {f"q{i}_deg": float(q[i - 1] / DEG) for i in range(1, 7)}
                    row |= {f"{name}_mm": round(float(at[i] / MM), 3) for i, name in enumerate("xyz")}
                    row |= {f"f{name}_n": float(force[i]) for i, name in enumerate("xyz")}
                    row |= {f"d{name}_mm": round(float(moved[i] / MM), 4) for i, name in enumerate("xyz")}
                    rows.append(row | {"replicate": replicate})
    return rows


def _manifest(name: str) -> Row:
    return {
        "format": 1,
        "batch": name,
        "title": "Side milling of AA6061-T6 with a KR160, three-tooth 16 mm end mill, one pose",
        "source": "simulated",
        "cell": "kr160",
        "tool": {
            "diameter_mm": 16,
            "teeth": 3,
            "helix_deg": 35,
            "pitch_deg": [120, 120, 120],
            "overhang_mm": 60,
        },
        "tool_in_flange_mm": list(TIP_MM),
        "tool_axes_in_flange": [list(row) for row in TOOL_AXES],
        "work": {"material": "AA6061-T6", "size_mm": list(SIZE_MM)},
        "work_in_base": {"xyz_mm": list(WORK_MM), "rpy_deg": [0, 0, YAW_DEG]},
        "instruments": {
            "dynamometer": {
                "rate_hz": 4096,
                "reads": "work",
                "axes": {"x": "-y", "y": "-x", "z": "-z"},
                "rotation_deg": 0,
                "range_n": 5000,
                "noise_n": 1.5,
            },
            "robot_log": {"period_ms": 12, "torque_noise_nm": 3.0},
            "profiler": {"spacing_mm": 0.05, "sigma_mm": 0.0005},
        },
        "known": {"tool_runout": {"radius_um": RUNOUT_UM, "angle_deg": RUNOUT_DEG}},
    }
