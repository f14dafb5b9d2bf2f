"""irb6640-setup: what is measured of a milling cell before the first face is cut.

Touched points that place tool and work, torques with and without the machining head; load tests, hammer
records and link masses of two wrists; encoders along a pass whose path error swings at
0.6 Hz; and two faces that are planned, for which all of this is a prediction.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from virtual_cell.arm import rotation_rpy
from virtual_cell.face import Passes
from virtual_cell.face_tables import load_rows, mass_row, path_rows
from virtual_cell.hammer import hit
from virtual_cell.link_mass import Body, holding, tip_mass
from virtual_cell.modes import Modes
from virtual_cell.noise import quantised
from virtual_cell.recipes import irb6640
from virtual_cell.recipes.irb6640 import FEED_MM, KNOWN, NEAR, SPINDLE_RPM, TOOL, WIDTH_MM, WRIST_YAW_DEG
from virtual_cell.tip_compliance import tip_compliance
from virtual_cell.units import DEG, MM, UM, Array
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_signal, write_yaml

SIZE_MM = (500.0, 100.0, 10.0)  # of the blocks of Iglesias et al. 2025
ORIGIN_MM = (1500.0, -300.0, 700.0)
# Masses (kg) and centres (mm, frame after the joint) that an arm of this size may have: none are published.
LINKS = (
    (430.0, (-260.0, 150.0, 20.0)),
    (250.0, (-550.0, 0.0, 80.0)),
    (330.0, (-100.0, 0.0, 150.0)),
    (90.0, (0.0, -450.0, 0.0)),
    (35.0, (0.0, 0.0, 30.0)),
    (12.0, (0.0, 0.0, -30.0)),
)
HEAD = (76.53, (-5.04, 0.30, 225.67))  # published, table 4
DAMPING = {"A": (0.92, 0.0021), "B": (0.92, 0.0021)}  # a0 (1/s), a1 (s)
SWING_HZ, SWING_MM = 0.6, 0.045  # of the path error, and how far it carries the tip
PERIOD = 0.012
ENCODER = 3e-6  # rad, noise
HAMMER_HZ, RING_S, HITS = 256.0, 6.0, 2
TOUCH, PIN_MM, TILTS = 20.0 * UM, (1600.0, 250.0, 600.0), 8  # noise of a touch; the fixed point; so often
BLOCK_MM = {  # where the faces of the block are touched: z = 0, y = 0, x = 0
    "primary": (
        (30.0, 20.0, 0.0),
        (470.0, 25.0, 0.0),
        (250.0, 85.0, 0.0),
        (60.0, 80.0, 0.0),
        (440.0, 85.0, 0.0),
    ),
    "secondary": ((40.0, 0.0, -4.0), (250.0, 0.0, -5.0), (460.0, 0.0, -4.0)),
    "tertiary": ((0.0, 30.0, -5.0), (0.0, 70.0, -5.0)),
}
HELD, TORQUE_NM = 24, (6.0, 6.0, 4.0, 1.5, 1.0, 0.8)  # poses held, and noise of the joints' torques
ARM = irb6640.ARM
_SIZE = (SIZE_MM[0] * MM, SIZE_MM[1] * MM)
_ORIGIN = np.array(ORIGIN_MM) * MM
_PLACES_MM = [(x, y) for x in (25.0, 250.0, 475.0) for y in (10.0, 50.0, 90.0)]
_MIDDLE_MM = (SIZE_MM[0] / 2.0, SIZE_MM[1] / 2.0)


def bodies() -> tuple[Body, ...]:
    """Return the links and the machining head, SI."""
    listed = [(joint, *link) for joint, link in enumerate(LINKS, start=1)]
    scaled = [(joint, mass, tuple(v * MM for v in at)) for joint, mass, at in [*listed, (6, *HEAD)]]
    return tuple(Body(joint, mass, (at[0], at[1], at[2])) for joint, mass, at in scaled)


def make(folder: Path) -> Row:
    """Write the batch; return the truth."""
    rng = np.random.default_rng(2606)
    fresh_folder(folder)
    loads, masses, impacts = [], [], []
    for wrist, yaw in WRIST_YAW_DEG.items():
        axes = rotation_rpy(0.0, 0.0, yaw * DEG)
        compliance = tip_compliance(ARM, _ORIGIN, axes, _SIZE, NEAR)
        loads.append(load_rows(wrist, compliance, _PLACES_MM, (150.0, 250.0), gauge=2.0 * UM, rng=rng))
        q = ARM.reach(_ORIGIN + np.array([*_MIDDLE_MM, 0.0]) * MM, axes, NEAR)
        mass = tip_mass(ARM, q, bodies())
        angles = {f"q{i}_deg": float(angle / DEG) for i, angle in enumerate(q, start=1)}
        masses.append(mass_row(wrist, "P5", _MIDDLE_MM, mass) | angles)
        stiffness = np.linalg.inv(compliance(np.array([_MIDDLE_MM]) * MM)[0])
        impacts += _struck(folder, wrist, mass, stiffness, rng)
    write_csv(folder / "loads.csv", itertools.chain(*loads))
    write_csv(folder / "mass.csv", masses)
    write_csv(folder / "impacts.csv", impacts)
    write_csv(folder / "touches.csv", _touches(rng))
    write_csv(folder / "payload.csv", _held(rng))
    write_signal(folder / "log/encoders.parquet", _encoders(rng))
    write_csv(folder / "path/L.csv", path_rows(_passes()))
    write_csv(folder / "runs.csv", _runs(), RUN_COLUMNS)
    write_yaml(folder / "cell.yaml", _cell())
    write_yaml(folder / "batch.yaml", _manifest(folder.name))
    return {"batch": folder.name, "effects": {}, "damping": DAMPING, "swing_hz": SWING_HZ}


def _passes() -> Passes:
    speed = FEED_MM * MM * TOOL.teeth * SPINDLE_RPM / 60.0
    return Passes(_SIZE, 0, WIDTH_MM * MM, TOOL.radius, speed, TOOL.radius + 4.0 * MM)


def _struck(folder: Path, wrist: str, mass: Array, stiffness: Array, rng: np.random.Generator) -> list[Row]:
    """Strike the tip along x, y and z, and write what an accelerometer beside the hammer hears."""
    from scipy.linalg import eigh

    squares, shapes = eigh(stiffness, mass)
    omega, (a0, a1) = np.sqrt(squares), DAMPING[wrist]
    ratio = 0.5 * (a0 / omega + a1 * omega)
    rows = []
    for axis, word in enumerate("xyz"):
        moved = np.abs(shapes[axis]) > 1e-6
        damped = omega[moved] * np.sqrt(1.0 - ratio[moved] ** 2) / (2.0 * math.pi)
        modes = Modes(damped, ratio[moved], squares[moved] / shapes[axis, moved] ** 2)
        for replicate in range(1, HITS + 1):
            file = f"hit/{wrist}-{word}{replicate}.parquet"
            write_signal(folder / file, hit(modes, HAMMER_HZ, RING_S, rng))
            rows.append(
                {
                    "test": f"tip-{wrist}",
                    "position": wrist,
                    "reference": f"1{word}",
                    "response": f"1{word}",
                    "replicate": replicate,
                    "kind": "record",
                    "file": file,
                    "response_unit": "m/s2",
                }
            )
    return rows


def _encoders(rng: np.random.Generator) -> dict[str, Array]:
    """Log one pass in the air along the middle of the block, wrist A; the first joint swings."""
    passes, axes = _passes(), rotation_rpy(0.0, 0.0, WRIST_YAW_DEG["A"] * DEG)
    t = np.arange(0.0, SIZE_MM[0] * MM / passes.speed, PERIOD)
    knots = np.linspace(0.0, t[-1], 60)
    places = _ORIGIN + np.column_stack([knots * passes.speed, np.full((60, 2), (0.05, 0.0))])
    from scipy.interpolate import CubicSpline

    wanted = CubicSpline(knots, ARM.follow(places, axes, NEAR))(t)
    actual = wanted + rng.normal(0.0, ENCODER, wanted.shape)
    reach = float(np.hypot(*ARM.pose(wanted[0])[0][:2]))
    actual[:, 0] += SWING_MM * MM / reach * np.sin(2.0 * math.pi * SWING_HZ * t + 0.7)
    held = replace(ARM, masses=np.array([mass for mass, _ in LINKS]))
    torque = np.array([held.gravity(q) for q in wanted]) + rng.normal(0.0, 2.0, wanted.shape)
    columns = {"t_s": t}
    columns |= {f"q{i}_set_deg": wanted[:, i - 1] / DEG for i in range(1, 7)}
    columns |= {f"q{i}_deg": quantised(actual[:, i - 1] / DEG, 1e-5) for i in range(1, 7)}
    return columns | {f"tau{i}_nm": quantised(torque[:, i - 1], 0.1) for i in range(1, 7)}


def _touches(rng: np.random.Generator) -> list[Row]:
    """Touch a fixed point with tilted tools, and the faces of the block with an upright one."""
    upright = rotation_rpy(0.0, 0.0, WRIST_YAW_DEG["A"] * DEG)
    tilts = rng.uniform(-25.0, 25.0, (TILTS, 3)) * DEG
    pin = np.array(PIN_MM) * MM
    touched: list[tuple[str, Array, Array]] = [("pin", pin, rotation_rpy(*tilt) @ upright) for tilt in tilts]
    for face, points in BLOCK_MM.items():
        touched += [(face, _ORIGIN + np.array(point) * MM, upright) for point in points]
    rows = []
    for name, point, axes in touched:
        flange = ARM.frames(ARM.reach(point, axes, NEAR))[6]
        at = (flange[:3, 3] + TOUCH * rng.normal(size=3)) / MM
        row: Row = {"touched": name} | {f"{a}_mm": round(float(v), 3) for a, v in zip("xyz", at, strict=True)}
        quaternion = _quaternion(flange[:3, :3])
        rows.append(row | {f"q{i}": round(float(v), 8) for i, v in enumerate(quaternion, start=1)})
    return rows


def _quaternion(turn: Array) -> Array:
    """Scalar first, as the controller has it."""
    from scipy.spatial.transform import Rotation

    x, y, z, scalar = Rotation.from_matrix(turn).as_quat()
    return np.array([scalar, x, y, z])


def _held(rng: np.random.Generator) -> list[Row]:
    """Hold the arm in some poses, with and without the machining head, and read the joints' torques."""
    spread, rows = np.array([30.0, 15.0, 15.0, 120.0, 70.0, 120.0]) * DEG, []
    for pose in range(HELD):
        q, loaded = NEAR + spread * rng.uniform(-1.0, 1.0, 6), pose % 2 == 0
        borne = bodies() if loaded else bodies()[:-1]
        torque = holding(ARM, q, borne) + np.array(TORQUE_NM) * rng.normal(size=6)
        row: Row = {"loaded": "yes" if loaded else "no"}
        row |= {f"q{i}_deg": round(float(angle / DEG), 4) for i, angle in enumerate(q, start=1)}
        rows.append(row | {f"tau{i}_nm": round(float(part), 2) for i, part in enumerate(torque, start=1)})
    return rows


def _runs() -> list[Row]:
    shared = {
        "operation": "face",
        "spindle_rpm": SPINDLE_RPM,
        "feed_per_tooth_mm": FEED_MM,
        "axial_depth_mm": 2.0,
        "radial_depth_mm": WIDTH_MM,
        "direction": "down",
        "feed_direction_deg": 0,
        "cut_length_mm": SIZE_MM[0] * SIZE_MM[1] / WIDTH_MM,
        "orientation": "L",
    }
    planned = [
        {"run": f"plan-{wrist}", "condition": f"wrist-{wrist}", "wrist": wrist, "pose": wrist, **shared}
        for wrist in WRIST_YAW_DEG
    ]
    rows: list[Row] = [row | {"path": "path/L.csv"} for row in planned]
    return [*rows, {"run": "encoders", "condition": "encoders", "robot_log": "log/encoders.parquet"}]


def _cell() -> Row:
    links = [{"mass_kg": mass, "centre_mm": list(at)} for mass, at in LINKS]
    head = {"mass_kg": HEAD[0], "centre_mm": list(HEAD[1])}
    arm = {"dh": ARM.dh.tolist(), "links": links, "head": head}
    return {"cell": "irb6640", "arm": arm, "joint_stiffness_nm_rad": ARM.stiffness.tolist()}


def _manifest(name: str) -> Row:
    return {
        "format": 1,
        "batch": name,
        "title": "Setting up a milling cell with an IRB 6640: loads, hammer, link masses, encoders",
        "source": "simulated",
        "cell": "irb6640",
        "tool": {"diameter_mm": 16, "teeth": 4, "helix_deg": 30, "pitch_deg": [90, 90, 90, 90]},
        "tool_in_flange_mm": (ARM.tip / MM).tolist(),
        "work": {"material": "AW-5013", "size_mm": list(SIZE_MM)},
        "work_in_base": {"xyz_mm": list(ORIGIN_MM), "rpy_deg": [0, 0, 0]},
        "coefficients": dict(KNOWN),
        "instruments": {
            "robot_log": {"period_ms": PERIOD / 0.001, "torque_noise_nm": 2.0},
            "hammer": {"rate_hz": HAMMER_HZ, "window": "none"},
        },
    }
