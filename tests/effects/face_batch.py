"""Batches of milled faces by formulas: the lowest cut of a dished cutter, brute force, at the scanned points.

What hides in a batch is a function of a cut (the axis, the point, the time) that is added to its height.
"""

from dataclasses import replace

import numpy as np
import pandas as pd
from face_manifest import SIZE, manifest
from fake_tables import FakeTables

from metro.batch.batch import Batch
from metro.batch.processed import COLUMNS
from metro.loop.search.trial import Gates
from metro.observables.cut import conditions as cutting_force
from metro.observables.flatness import observable as flatness
from metro.observables.problem import Problem

GATES = Gates(model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)
RADIUS, PITCH, SPEED = 8.0, 10.0, 40.0  # mm, mm/s
LEAD = 12.0
CASES = [(along, depth, role) for along, depth, role in (
    ("L", 1.0, "identify"), ("T", 1.0, "identify"), ("L", 2.0, "identify"), ("T", 2.0, "identify"),
    ("L", 1.5, "validate"), ("T", 1.5, "validate"),
)]  # fmt: skip
MANIFEST = manifest(spacing_mm=0.8, sigma_mm=0.006)


def compliance(x, y):
    """C (n, 3, 3) in mm/N at points in mm: varies linearly over the plate."""
    base = np.array([[2.9, 0.1, 0.7], [0.1, 1.4, -0.3], [0.7, -0.3, 1.2]]) * 1e-3
    slope = np.array([[1.0, 0.1, 0.6], [0.1, 0.8, 0.2], [0.6, 0.2, 1.0]]) * 4e-6
    return base + np.multiply.outer(x - 60.0, slope) - np.multiply.outer(y - 30.0, 0.5 * slope)


def lanes(along):
    return np.arange(2.0, SIZE[1 if along == "L" else 0], PITCH)


def path(along):
    length = SIZE[0 if along == "L" else 1]
    s = np.arange(-LEAD, length + LEAD + 0.1, 2.0)
    way, lane = np.tile(s, len(lanes(along))), np.repeat(lanes(along), len(s))
    x, y = (way, lane) if along == "L" else (lane, way)
    number = np.repeat(np.arange(1, len(lanes(along)) + 1), len(s))
    return pd.DataFrame({"point": np.arange(len(way)) + 1, "pass": number, "x_mm": x, "y_mm": y, "z_mm": 0.0})


def surface(along, force, cut_by, x, y, *, factor):
    """Height (n,) mm of a face: of all cuts over each point, the lowest."""
    length = SIZE[0 if along == "L" else 1]
    way, lane = (x, y) if along == "L" else (y, x)
    period = (length + 2 * LEAD) / SPEED + (length + 2 * LEAD) / 200.0 + 0.6
    lowest = np.full(len(x), np.inf)
    for number, middle in enumerate(lanes(along)):
        reach = np.sqrt(np.maximum(RADIUS**2 - (lane - middle) ** 2, 0.0))
        for side in (-1.0, 1.0):
            axis = way + side * reach
            at = (axis, np.full(len(x), middle))
            at_x, at_y = at if along == "L" else at[::-1]
            cut = (compliance(at_x, at_y) @ force)[:, 2] / factor
            cut = cut + cut_by(
                number=number,
                time=number * period + (axis + LEAD) / SPEED,
                way=axis,
                dx=x - at_x,
                dy=y - at_y,
                length=length,
                load=float(np.linalg.norm(force)),
            )
            over = (np.abs(lane - middle) < RADIUS) & (axis >= -LEAD) & (axis <= length + LEAD)
            lowest = np.where(over, np.minimum(lowest, cut), lowest)
    return lowest


def nothing(**_cut):
    return 0.0


def batch_of():
    rows = []
    for repeat in range(2):
        for along, depth, role in CASES:
            order = len(rows) + 1
            rows.append(
                {"run": f"r{order}", "role": role, "condition": f"{along}{depth}", "order": order}
                | {"operation": "face", "direction": "down", "spindle_rpm": 12000.0, "pose": "A"}
                | {"feed_per_tooth_mm": 0.05, "axial_depth_mm": depth, "radial_depth_mm": 10.0}
                | {"feed_direction_deg": 0.0 if along == "L" else 90.0, "replicate": repeat + 1}
                | {"scan": f"r{order}.ply", "path": f"{along}.csv"}
            )
    return Batch("plate", MANIFEST, {"cell": "c"}, pd.DataFrame(rows).set_index("run"), {})


def problem(hidden=nothing, work=None, *, factor=1.0, seed=1, placed=True, noise=6e-3):
    """Problem of twelve faces; ``hidden(**cut)`` mm, ``work(x, y)`` mm: higher at a cut, at a point."""
    rng = np.random.default_rng(seed)
    batch = batch_of()
    if not placed:
        scanner = {"spacing_mm": 0.8, "sigma_mm": 0.006}
        batch = replace(batch, manifest=MANIFEST | {"instruments": {"scanner": scanner}})
    values = cutting_force.coefficients(batch, {})
    draws = {run: 1 + 0.01 * rng.normal(size=3) for run in batch.runs.index}
    placing = {run: rng.normal(size=3) * [10e-3, 3e-3, 3e-3] for run in batch.runs.index}

    def scan(run):
        x, y = (c.ravel() for c in np.meshgrid(*(np.arange(0.4, extent, 0.8) for extent in SIZE)))
        along = batch.runs.loc[run, "path"][0]
        force = cutting_force.mean_force_on_tool(batch, run, values) * draws[run]
        own = rng.uniform(0.0, 2 * np.pi)
        z = surface(along, force, lambda **cut: hidden(**cut, phase=own), x, y, factor=factor)
        offset, tilt_x, tilt_y = placing[run]
        z = z + offset + tilt_x * (x / 60.0 - 1.0) + tilt_y * (y / 30.0 - 1.0)
        z = z + (work(x, y) if work else 0.0) + rng.normal(0.0, noise, x.size)
        return pd.DataFrame({"run": run, "x_mm": x, "y_mm": y, "z_mm": z})

    def read(name, run=None):
        made = {"scan": lambda: scan(run), "loads": lambda: loads(rng)}
        made["path"] = lambda: path(batch.runs.loc[run, "path"][0])
        return made[name]() if name in made else pd.DataFrame(columns=list(COLUMNS[name]))

    task = flatness.problem(batch, flatness.observe(batch, FakeTables(read), {}), {})
    assert isinstance(task, Problem), task
    return task


def loads(rng):
    rows = []
    for number, (x, y) in enumerate((x, y) for x in (10.0, 60.0, 110.0) for y in (5.0, 55.0)):
        matrix = compliance(np.array([x]), np.array([y]))[0]
        for axis in range(3):
            for newton in (150.0, 250.0):
                force = newton * np.eye(3)[axis]
                moved = matrix @ force + rng.normal(0.0, 1e-3, 3)
                rows.append(["A", f"P{number}", x, y, 0.0, *force, *moved, 1])
    known = [
        "pose",
        "point",
        "x_mm",
        "y_mm",
        "z_mm",
        *(f"f{a}_n" for a in "xyz"),
        *(f"d{a}_mm" for a in "xyz"),
    ]
    return pd.DataFrame(rows, columns=[*known, "replicate"]).reindex(columns=list(COLUMNS["loads"]))
