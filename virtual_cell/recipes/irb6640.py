"""irb6640-face: face milling of aluminium with a large robot, softer in the cut than in its load tests."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from virtual_cell.arm import Arm, rotation_rpy
from virtual_cell.chips import Engagement, Tool
from virtual_cell.face import Passes, Surroundings, surface
from virtual_cell.face_tables import load_rows, mass_row, path_rows
from virtual_cell.milling import Cut, forces, in_millimetres, scattered
from virtual_cell.motion import Straight
from virtual_cell.scanner import Scanner, scan
from virtual_cell.session import spread
from virtual_cell.tip import Tip, tip_heights
from virtual_cell.tip_compliance import tip_compliance
from virtual_cell.units import DEG, MM, RPM, UM, Array
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_ply, write_yaml

FACTOR = 0.8
SIZE_MM = (200.0, 100.0, 10.0)
_SIZE = (SIZE_MM[0] * MM, SIZE_MM[1] * MM)
WORK_MM = (1650.0, -250.0, 700.0)
KNOWN = {
    "ktc_n_mm2": 905.0,
    "krc_n_mm2": 402.0,
    "kac_n_mm2": 468.0,
    "kte_n_mm": 16.4,
    "kre_n_mm": 19.9,
    "kae_n_mm": 21.7,
}
COEFFICIENTS = in_millimetres(list(KNOWN.values())[:3], list(KNOWN.values())[3:])
TOOL = Tool(8.0 * MM, 30.0 * DEG, np.arange(4) * 90.0 * DEG)
SPINDLE_RPM, FEED_MM, WIDTH_MM = 12000.0, 0.05, 10.0
_DH = (
    *((0, -90, 780, 320), (-90, 0, 0, 1075), (0, -90, 0, 200)),
    *((0, 90, 1142.5, 0), (0, -90, 0, 0), (180, 0, 200, 0)),
)
ARM = Arm(
    np.array(_DH),
    np.array([190.0, 0.0, 260.0]) * MM,
    np.array([[0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0]]),
    np.array([2.6e6, 3.4e6, 2.5e6, 6.0e5, 6.6e5, 4.4e5]),
    np.zeros(6),
)
NEAR = np.array([-8.0, 10.0, 10.0, 5.0, -20.0, 5.0]) * DEG
WRIST_YAW_DEG = {"A": 180.0, "B": 145.0}
# published at the plate's middle, by wrist: mass (kg), a0 (1/s), a1 (s)
MASS = {
    "A": np.array([[654.58, 0.0, 382.51], [0.0, 903.38, 0.0], [382.51, 0.0, 269.57]]),
    "B": np.array([[651.36, 5.2, 378.43], [5.2, 918.41, 3.83], [378.43, 3.83, 269.11]]),
}
DAMPING = {"A": (0.9228, 0.00209), "B": (0.9188, 0.00210)}
TO_WORK = np.array(
    [[0.0, -1.0, 0.0, 260.0], [1.0, 0.0, 0.0, -35.0], [0.0, 0.0, 1.0, -120.0], [0.0, 0.0, 0.0, 1.0]]
)
_SCANNER = Scanner(1.1 * MM, 19.0 * UM, TO_WORK)
_PLACES_MM = [(x, y) for x in (10.0, 100.0, 190.0) for y in (10.0, 50.0, 90.0)]


@dataclass(frozen=True)
class Case:
    """A condition: factor levels and axial depth."""

    condition: str
    role: str
    wrist: str
    orientation: str
    depth_mm: float
    replicates: int = 2


CASES = (
    Case("a-l-2", "identify", "A", "L", 2.0),
    Case("a-t-2", "identify", "A", "T", 2.0),
    Case("b-l-2", "identify", "B", "L", 2.0),
    Case("a-l-1", "identify", "A", "L", 1.0),
    Case("b-t-2", "validate", "B", "T", 2.0),
    Case("b-l-1.5", "validate", "B", "L", 1.5),
)


def make(folder: Path, around: Surroundings | None = None, factor: float = FACTOR) -> Row:
    """Write the batch; return the truth."""
    rng = np.random.default_rng(2604)
    fresh_folder(folder)
    compliance = {wrist: _compliance(wrist) for wrist in WRIST_YAW_DEG}
    rows = []
    for place, (case, replicate) in enumerate(spread(CASES, rng), start=1):
        run = f"r{place:02d}"
        write_ply(
            folder / f"scan/{run}.ply",
            _cut(case, compliance[case.wrist], factor, around or Surroundings(), rng),
        )
        rows.append(_row(case, run, place, replicate))
    for orientation in ("L", "T"):
        write_csv(folder / f"path/{orientation}.csv", path_rows(_passes(orientation)))
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    newtons, gauge = (150.0, 250.0), 2.0 * UM
    loads = [
        load_rows(pose, of, _PLACES_MM, newtons, gauge=gauge, rng=rng) for pose, of in compliance.items()
    ]
    write_csv(folder / "loads.csv", itertools.chain(*loads))
    middle = (SIZE_MM[0] / 2.0, SIZE_MM[1] / 2.0)
    write_csv(folder / "mass.csv", [mass_row(pose, "P5", middle, mass) for pose, mass in MASS.items()])
    write_yaml(folder / "cell.yaml", {"cell": "irb6640"})
    write_yaml(folder / "batch.yaml", _manifest(folder.name))
    return {"batch": folder.name, "effects": {"stiffness_scale": {"factor": factor}}}


def _passes(orientation: str) -> Passes:
    speed = FEED_MM * MM * TOOL.teeth * SPINDLE_RPM / 60.0
    return Passes(
        _SIZE, 0 if orientation == "L" else 1, WIDTH_MM * MM, TOOL.radius, speed, TOOL.radius + 4.0 * MM
    )


def _compliance(wrist: str) -> Callable[[Array], Array]:
    """Compliance (n, 3, 3), m/N, of the tip over points (n, 2) of the plate."""
    axes = rotation_rpy(0.0, 0.0, WRIST_YAW_DEG[wrist] * DEG)
    return tip_compliance(ARM, np.array(WORK_MM) * MM, axes, _SIZE, NEAR)


def _cut(
    case: Case,
    compliance: Callable[[Array], Array],
    factor: float,
    around: Surroundings,
    rng: np.random.Generator,
) -> Array:
    """Mill one face and scan it."""
    passes = _passes(case.orientation)
    tip = Tip(
        MASS[case.wrist], *DAMPING[case.wrist], lambda points: factor * np.linalg.inv(compliance(points))
    )
    x, force = _mean_force(case, passes, rng)

    def load(s: Array) -> Array:
        seen = np.stack([np.interp(s, x, part, left=0.0, right=0.0) for part in force.T], axis=1)
        return seen if passes.along == 0 else np.column_stack([-seen[:, 1], seen[:, 0], seen[:, 2]])

    heights = tip_heights(passes, tip, load)
    return scan(_SCANNER, _SIZE, lambda points: surface(passes, heights, around, points), rng)


def _mean_force(case: Case, passes: Passes, rng: np.random.Generator) -> tuple[Array, Array]:
    """Force (n, 3), N, feed frame, averaged over a revolution, along positions (n,), m, of the axis."""
    spindle = SPINDLE_RPM * RPM * (1.0 + 0.003 * rng.uniform(-1.0, 1.0))
    coefficients = scattered(COEFFICIENTS, 0.01, rng)
    motion = Straight(passes.speed, -passes.lead, passes.length, "down", TOOL.radius - WIDTH_MM * MM)
    engagement = Engagement(TOOL, motion, spindle, rng.uniform(0.0, 2.0 * math.pi), case.depth_mm * MM)
    per_turn = 36
    t = np.arange(0.0, (passes.length + 2.0 * passes.lead) / passes.speed, 2.0 * math.pi / spindle / per_turn)
    force = forces(Cut(engagement, coefficients), t)
    kept = len(t) // per_turn * per_turn
    mean = force[:kept].reshape(-1, per_turn, 3).mean(axis=1)
    return motion.centre(t[:kept].reshape(-1, per_turn).mean(axis=1))[0], mean


def _row(case: Case, run: str, place: int, replicate: int) -> Row:
    return {
        "run": run,
        "role": case.role,
        "condition": case.condition,
        "replicate": replicate,
        "order": place,
        "operation": "face",
        "spindle_rpm": SPINDLE_RPM,
        "feed_per_tooth_mm": FEED_MM,
        "axial_depth_mm": case.depth_mm,
        "radial_depth_mm": WIDTH_MM,
        "direction": "down",
        "feed_direction_deg": 0 if case.orientation == "L" else 90,
        "cut_length_mm": SIZE_MM[0] * SIZE_MM[1] / WIDTH_MM,
        "wrist": case.wrist,
        "orientation": case.orientation,
        "pose": case.wrist,
        "path": f"path/{case.orientation}.csv",
        "scan": f"scan/{run}.ply",
    }


def _manifest(name: str) -> Row:
    return {
        "format": 1,
        "batch": name,
        "title": "Face milling of AW-5013 with an IRB 6640: two wrists, two directions, three depths",
        "source": "simulated",
        "cell": "irb6640",
        "tool": {"diameter_mm": 16, "teeth": 4, "helix_deg": 30, "pitch_deg": [90, 90, 90, 90]},
        "work": {"material": "AW-5013", "size_mm": list(SIZE_MM)},
        "work_in_base": {"xyz_mm": list(WORK_MM), "rpy_deg": [0, 0, 0]},
        "coefficients": dict(KNOWN),
        "instruments": {
            "scanner": {
                "spacing_mm": _SCANNER.spacing / MM,
                "sigma_mm": _SCANNER.sigma / MM,
                "to_work": TO_WORK.tolist(),
            }
        },
    }
