"""Seconds for the prediction of one face: transients, overlap of passes and footprint at 2500 path points.

500 mm by 100 mm in ten passes at 40 mm/s, the published arm. Target: 1 s on one core, all from the tables of
the pose on; and once more for another damping, as a fit asks for it. Peer: ``solve_ivp`` (LSODA, tolerance
1e-6) on the same equations of motion. Run: ``pytest benchmarks/bench_face.py``.
"""

import time

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.observables.cut import conditions as cutting_force
from metro.observables.flatness.dynamics import TipDynamics
from metro.observables.flatness.path import force_over_period, make_path, passages
from metro.observables.flatness.ringing import make_ringing
from metro.structure import Structure
from metro.surface.tip_damping import Rayleigh
from metro.surface.tip_field import field_in
from metro.surface.tip_stiffness import basis_over
from metro.units import MM

MASS = np.array([[654.58, 0.0, 382.51], [0.0, 903.38, 0.0], [382.51, 0.0, 269.57]])
STIFFNESS = np.diag([3.32e5, 7.15e5, 8.77e5])
A0, A1 = 0.9228, 0.00209
COEFFICIENTS = {"ktc": 905.0, "krc": 402.0, "kac": 468.0, "kte": 16.4, "kre": 19.9, "kae": 21.7}
TARGET, POINTS, PASSES, SIZE = 1.0, 2500, 10, (500.0, 100.0, 10.0)


def face():
    manifest = {"tool": {"diameter_mm": 16, "teeth": 4, "helix_deg": 30}, "work": {"size_mm": [*SIZE]}}
    row = {
        "run": "r",
        "operation": "face",
        "direction": "down",
        "spindle_rpm": 12000.0,
        "axial_depth_mm": 2.0,
    }
    row |= {"radial_depth_mm": 10.0, "feed_per_tooth_mm": 0.05, "feed_direction_deg": 0.0}
    batch = Batch("face", manifest, {"cell": "c"}, pd.DataFrame([row]).set_index("run"), {})
    s = np.linspace(-8.0, SIZE[0] + 8.0, POINTS // PASSES)
    lanes = 2.0 + 10.0 * np.arange(PASSES)
    table = pd.DataFrame({"pass": np.repeat(np.arange(PASSES), len(s)), "x_mm": np.tile(s, PASSES)})
    return batch, table.assign(y_mm=np.repeat(lanes, len(s)))


def arm():
    x, y = (c.ravel() for c in np.meshgrid([0.0, 0.5], [0.0, 0.1]))
    soft = np.linalg.inv(STIFFNESS) * (1 + 0.4 * x)[:, None, None]
    mass = field_in(basis_over(x, y, 1), x, y, np.tile(MASS, (4, 1, 1)))
    damping = Rayleigh(np.array([A0, A1]), np.eye(2) * 1e-12, float("nan"))
    return TipDynamics(mass, field_in(basis_over(x, y, 3), x, y, soft), damping)


def predicted(batch, table):
    path, dynamics = make_path(table), arm()
    x, y = table["x_mm"].to_numpy() * MM, table["y_mm"].to_numpy() * MM
    full = cutting_force.mean_force_on_tool(batch, "r", COEFFICIENTS)
    ringing = make_ringing(batch, "r", path, dynamics, COEFFICIENTS, full=full)
    seen = passages(path, x, y, 8 * MM)
    soft = dynamics.compliance(seen.x.ravel(), seen.y.ravel()) @ full
    cuts = soft[:, 2].reshape(seen.x.shape) + ringing.heights(Structure(), seen)
    return np.where(seen.valid, cuts, np.inf).min(axis=1), ringing, seen


def test_a_face_of_2500_points(benchmark):
    batch, table = face()
    heights, *_ = benchmark.pedantic(predicted, (batch, table), rounds=5, warmup_rounds=1)
    assert heights.shape == (POINTS,)
    assert benchmark.stats["min"] < TARGET


def test_the_same_face_at_another_stiffness(benchmark):
    _, ringing, seen = predicted(*face())
    benchmark.pedantic(ringing.heights, (Structure(0.8), seen), rounds=5, warmup_rounds=1)
    assert benchmark.stats["min"] < TARGET


def test_the_motion_against_solve_ivps(benchmark):
    from scipy.integrate import solve_ivp

    batch, table = face()
    _, ringing, seen = predicted(batch, table)
    benchmark.pedantic(ringing.heights, (Structure(), seen), rounds=3)
    tool = cutting_force.cutter(batch)
    force, period, _ = force_over_period(batch, "r", COEFFICIENTS, make_path(table), tool)
    inverse, damping = np.linalg.inv(MASS), A0 * MASS + A1 * STIFFNESS

    def motion(t, now):
        place = np.arange(len(force)) * period / len(force)
        push = np.array([np.interp(t, place, part) for part in force.T])
        return np.concatenate([now[3:], inverse @ (push - damping @ now[3:] - STIFFNESS @ now[:3])])

    start = time.perf_counter()
    solve_ivp(motion, (0, period), np.zeros(6), method="LSODA", rtol=1e-6, atol=1e-12)
    seconds = PASSES * (time.perf_counter() - start)
    benchmark.extra_info["ratio_to_solve_ivp"] = seconds / benchmark.stats["min"]
    assert seconds > benchmark.stats["min"]
