"""Deformation from raw logs, profiles and load tests to blocks and report, on a batch made here.

The arm's tip comes from its forward kinematics (tested against trigonometry); torques, deflections and loads
are made from differences of it (virtual work), never from the statics that the model uses.
"""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from fake_tables import FakeTables

from metro.batch.batch import Batch
from metro.loop.fitting.held_out import identified_fit
from metro.observables.arm import tip_force
from metro.observables.arm.wall import wall
from metro.observables.deformation import observable as deformation
from metro.observables.deformation.blocks import (
    LINKS,
    LOADED,
    OF_LINKS,
    SOFTER,
    TOUCHED,
    TWISTED,
    ZERO,
    with_zeros,
)
from metro.observables.deformation.setting import CutWall
from metro.observables.problem import BaseFit, Problem, Refusal
from metro.robot.kinematics import arm_of_cell, link_frames
from metro.stages.identify import base_fit
from metro.structure import Structure
from metro.units import DEG, MM

DH = [[0, 90, 500, 250], [90, 0, 0, 610], [-180, -90, 0, 70], [0, 90, 710, 0], [0, -90, 0, 0], [0, 0, 215, 0]]
STIFFNESS = np.array([1.8e6, 2.1e6, 1.3e6, 3.1e5, 3.9e5, 2.3e5])
TIP = [212.5, 0.0, 279.91]
NEAR = np.array([-20.3, -13.9, -4.4, -61.7, 34.9, 56.7]) * DEG
LENGTH, DEPTH, RADIUS = 60.0, 4.0, 8.0
FORCES = {"down": np.array([90.0, 150.0, 40.0]), "up": np.array([-120.0, 60.0, 45.0])}  # feed frame
COEFFICIENTS = {
    "ktc_n_mm2": 870.0,
    "krc_n_mm2": 300.0,
    "kac_n_mm2": 180.0,
    "kte_n_mm": 13.0,
    "kre_n_mm": 18.0,
    "kae_n_mm": 4.0,
}
MASSES = np.array([320.0, 240.0, 60.0, 90.0, 15.0, 25.0])  # kg, each where the frame of its link begins
FRICTION = np.array([160, 190, 130, 45, 38, 26.0])
COLUMNS = [f"q{i}_deg" for i in range(1, 7)]


def moves(arm, q, step=1e-6):
    """Columns ∂x_tip/∂q_i in the work frame, by differences: (..., 3, 6)."""
    return np.stack(
        [(arm.tip(q + step * e) - arm.tip(q - step * e)) / (2 * step) for e in np.eye(6)], axis=-1
    )


PATHS = {}


def follow(arm, points):
    """Joint angles (n, 6) that bring the tip to ``points`` (n, 3), each the nearest to the last."""
    key = points.tobytes()
    if key not in PATHS:
        PATHS[key] = _followed(arm, points)
    return PATHS[key]


def _followed(arm, points):
    q, path = NEAR.copy(), []
    for point in points:
        for _ in range(20 if not path else 2):
            q = q + np.linalg.pinv(moves(arm, q)) @ (point - arm.tip(q))
        path.append(q)
    return np.array(path)


def deflection(arm, q, force, factor):
    """Where the tip goes when every spring twists by (virtual work of the force) / k."""
    by_joint = moves(arm, q)
    return by_joint @ ((by_joint.T @ force) / (factor * STIFFNESS))


def holding(q, step=1e-6):
    """Torques (n, 6) that hold the arm against its weight: how its potential energy rises with each joint."""

    def energy(q):
        return 9.81 * link_frames(arm_of_cell({"arm": {"dh": DH}}, {}).dh, q)[:, 1:, 2, 3] @ MASSES

    return np.stack([(energy(q + step * e) - energy(q - step * e)) / (2 * step) for e in np.eye(6)], axis=-1)


class Cell:
    """A batch: one run each way, twice; ``read`` as the stages give it."""

    def __init__(self, factor=1.0, feed_deg=90.0, force_scale=1.0, tracking=0.0, noise=0.05):
        self.rng = np.random.default_rng(11)
        work = {"xyz_mm": [1510.0, -210.0, 590.0], "rpy_deg": [0, 0, 30]}
        manifest = {
            "tool": {"diameter_mm": 2 * RADIUS, "teeth": 3},
            "tool_in_flange_mm": TIP,
            "work_in_base": work,
            "work": {"size_mm": [LENGTH, LENGTH, 20.0]},
            "instruments": {"profiler": {"sigma_mm": 0.0005}},
        }
        rows, self.logs, self.profiles = [], {}, {}
        self.arm = arm_of_cell({"arm": {"dh": DH}}, manifest)
        self.factor, self.scale, self.tracking, self.noise = factor, force_scale, tracking, noise
        for order, (run, way, role) in enumerate(
            [("r1", "down", "identify"), ("r2", "up", "identify"), ("r3", "down", "validate")], start=1
        ):
            self._cut(run, way, feed_deg)
            rows.append(
                {"run": run, "role": role, "condition": f"{way}-{role}", "order": order, "direction": way}
                | {
                    "operation": "side",
                    "feed_direction_deg": feed_deg,
                    "radial_depth_mm": DEPTH,
                    "pose": "p0",
                }
                | {
                    "axial_depth_mm": 5.0,
                    "feed_per_tooth_mm": 0.06,
                    "spindle_rpm": 4000.0,
                    "cut_before_m": 0.0,
                }
                | {"cut_length_mm": LENGTH, "dynamometer": ""}
                | dict.fromkeys(["robot_log", "idle_log", "profile"], "file")
            )
        self.loads = self._load_tests()
        self.batch = Batch(
            "b", manifest, {"cell": "kr", "arm": {"dh": DH}}, pd.DataFrame(rows).set_index("run"), {}
        )

    def _cut(self, run, way, feed_deg):
        c, s = np.cos(feed_deg * DEG), np.sin(feed_deg * DEG)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
        entry = min(0.0, LENGTH * c) + min(0.0, LENGTH * s)
        x = np.arange(-15.0, LENGTH + 15.0, 0.15)
        across = np.array([c, s, 0]) * (x[:, None] + entry) + turn[:, 1] * 5.0 + [0, 0, -4.0]
        q = follow(self.arm, across * MM)
        force = self.scale * turn @ FORCES[way] * ((x >= 0) & (x <= LENGTH))[:, None]
        torque = -np.einsum("nai,na->ni", moves(self.arm, q), force)
        strayed = q + self.tracking * np.sin(2 * np.pi * x / 20)[:, None] * [0, 0, 0, 0, 0, 1.0]
        cut = self._log(q, strayed, self._base(q) + torque, "cut")
        idle = self._log(q[37:], strayed[37:], self._base(q[37:]), "idle")
        self.logs[run] = pd.concat([cut, idle], ignore_index=True)
        normal = turn[:, 1] * (1.0 if way == "down" else -1.0)
        inside = np.flatnonzero((x >= 0) & (x <= LENGTH))[::10]
        bent = -(held := holding(q)) + held[np.argmin(np.abs(x - LENGTH / 2))]  # touched in mid-wall
        z = [
            normal
            @ (
                deflection(self.arm, q[i], force[i], self.factor)
                + moves(self.arm, q[i]) @ (bent[i] / (self.factor * STIFFNESS))
                + self.arm.tip(strayed[i])
                - self.arm.tip(q[i])
            )
            for i in inside
        ]
        fine = np.arange(0, LENGTH, 0.05)
        rough = 2e-3 * np.sin(2 * np.pi * fine / 0.2) + self.rng.normal(0, 5e-4, len(fine))
        self.profiles[run] = pd.DataFrame({"x_mm": fine, "z_mm": np.interp(fine, x[inside], z) / MM + rough})

    def _base(self, q):
        """Torque of weight and friction, the same for both logs."""
        return holding(q) + FRICTION + self.rng.normal(0, self.noise, q.shape)

    def _log(self, commanded, actual, torque, name):
        table = {"log": name, "t_s": 0.012 * np.arange(len(torque))}
        for i in range(6):
            table |= {f"q{i + 1}_set_deg": commanded[:, i] / DEG, f"q{i + 1}_deg": actual[:, i] / DEG}
            table[f"tau{i + 1}_nm"] = torque[:, i]
        return pd.DataFrame(table)

    def _load_tests(self):
        rows = []
        for pose in range(4):
            q = NEAR + self.rng.uniform(-0.4, 0.4, 6)
            for force in 300 * np.vstack([np.eye(3), -np.eye(3)]):
                moved = deflection(self.arm, q, force, 1.0) / MM + self.rng.normal(0, 0.002, 3)
                rows.append([f"p{pose}", *(q / DEG), *force, *moved])
        names = ["pose", *COLUMNS, "fx_n", "fy_n", "fz_n", "dx_mm", "dy_mm", "dz_mm"]
        table = pd.DataFrame(rows, columns=names)
        table.loc[::5, "dy_mm"] = np.nan
        return table

    def read(self, name, run=None):
        if name == "loads":
            return self.loads
        if name == "force":
            return pd.DataFrame({"t_s": [], "fx_n": [], "fy_n": [], "fz_n": []}, dtype=float)
        tables = {"robot": self.logs, "profile": self.profiles}[name]
        return tables[run] if run else pd.concat([one.assign(run=of) for of, one in tables.items()])

    def task(self, identified=None):
        observed = deformation.observe(self.batch, FakeTables(self.read), identified or {})
        return observed, deformation.problem(self.batch, observed, identified or {})


def solved(task, roles=("calibrate", "identify")):
    """Plain weighted least squares over the blocks, nothing shared between elements."""
    rows, right = [], []
    for block in task.role(*roles):
        matrix, offset = task.base.design(block, np.zeros(0))
        rows.append(matrix / block.sigma[:, None])
        right.append((block.measured - offset) / block.sigma)
    matrix, target = np.vstack(rows), np.concatenate(right)
    return np.linalg.lstsq(matrix, target, rcond=None)[0], np.linalg.inv(matrix.T @ matrix)


def whole(model, compliance):
    """Base parameters with all that is believed of beforehand as it is believed."""
    return np.concatenate([compliance, np.zeros(len(model.believed))])


def predicted(model, block, beta):
    matrix, offset = model.design(block, np.zeros(0))
    return matrix @ beta + offset


@pytest.fixture(scope="module")
def cell():
    return Cell(tracking=2e-5)


@pytest.fixture(scope="module")
def built(cell):
    return cell.task()


def test_the_sensorless_force_is_that_which_made_the_torques(cell, built):
    observed, _ = built
    for run, way in (("r1", "down"), ("r2", "up"), ("r3", "down")):
        table = observed["tip_force"][observed["tip_force"]["run"] == run]
        rows = table[table["x_mm"].between(6, 50)]
        assert set(rows["source"]) == {"torque"}
        fx, fy, fz = FORCES[way]
        expected = [-fy, fx, fz]  # feed along work y
        np.testing.assert_allclose(rows[["fx_n", "fy_n", "fz_n"]].mean(), expected, atol=1.5)
        air = table[table["x_mm"] < -4]
        assert np.abs(air[["fx_n", "fy_n", "fz_n"]]).max().max() < 6


def test_load_tests_alone_predict_walls_that_were_cut_with_the_same_stiffness(built):
    _, task = built
    beta, _ = solved(task, ("calibrate",))
    np.testing.assert_allclose(1 / task.base.compliance(beta), STIFFNESS, rtol=0.05)
    for block in task.role("identify", "validate"):
        assert np.abs(block.measured).mean() > 20e-6
        np.testing.assert_allclose(predicted(task.base, block, beta), block.measured, atol=4e-6)


def test_a_softer_cut_shows_as_its_factor_in_the_structure_and_leaves_load_tests_alone():
    _, task = Cell(factor=0.8).task()
    beta, _ = solved(task, ("calibrate",))
    softer = replace(task.base, structure=Structure(0.8))
    for block in task.role("identify", "validate"):
        ratio = block.measured.mean() / predicted(task.base, block, beta).mean()
        assert ratio == pytest.approx(1 / 0.8, rel=0.03)
        np.testing.assert_allclose(predicted(softer, block, beta), block.measured, atol=4e-6)
    for block in task.role("calibrate"):
        np.testing.assert_array_equal(predicted(softer, block, beta), predicted(task.base, block, beta))


def test_what_the_tip_strays_is_on_the_wall_without_any_force():
    """5e-4 rad of joint 6 on a wave of 20 mm; the filter passes exp(−π (0.4697·8/20)²) = 0.895 of it."""
    cell = Cell(tracking=5e-4, force_scale=1e-9)
    # no torque tells a force then: it is zero by the coefficients that the manifest gives
    cell.batch.manifest["coefficients"] = dict.fromkeys(COEFFICIENTS, 0.0)
    observed, task = cell.task()
    assert set(observed["tip_force"]["source"]) == {"coefficients"}
    points = observed["profile_points"].query("run == 'r1' and 8 < x_mm < 50")
    lever = np.abs(moves(cell.arm, NEAR)[:, 5] @ wall(cell.batch, "r1").normal)
    assert points["deformation_mm"].abs().max() == pytest.approx(0.895 * 5e-4 * lever / MM, rel=0.2)
    np.testing.assert_allclose(points["tracking_mm"], points["deformation_mm"], atol=2e-3)
    for block in task.role("identify", "validate"):
        np.testing.assert_allclose(
            predicted(task.base, block, whole(task.base, np.zeros(6))), block.measured, atol=2e-6
        )


def test_a_tool_pushed_away_from_the_wall_leaves_material_whichever_way_it_cuts(cell):
    """Seen from the tool, the wall lies at −y of the feed in down milling and at +y in up milling."""
    down, up = wall(cell.batch, "r1"), wall(cell.batch, "r2")
    np.testing.assert_allclose(down.along, [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(down.normal, [-1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(up.normal, [1, 0, 0], atol=1e-12)


@pytest.mark.parametrize(("degrees", "start"), [(0, 0.0), (90, 0.0), (180, -0.06), (270, -0.06)])
def test_the_wall_begins_at_the_face_where_the_feed_enters_the_block(cell, degrees, start):
    batch = replace(cell.batch, runs=cell.batch.runs.assign(feed_direction_deg=degrees))
    face = wall(batch, "r1")
    assert face.start == pytest.approx(start, abs=1e-12)
    assert face.length == pytest.approx(0.06)
    # the arc of a 4 mm deep cut with a radius of 8 mm reaches R sin 60° ahead of the axis
    assert face.leaving == pytest.approx(8e-3 * np.sin(np.pi / 3))


def test_feeding_the_other_way_changes_nothing_but_the_frame():
    observed, task = Cell(feed_deg=180.0).task()
    beta, _ = solved(task, ("calibrate",))
    for block in task.role("identify", "validate"):
        np.testing.assert_allclose(predicted(task.base, block, beta), block.measured, atol=4e-6)
    assert observed["profile_points"]["x_mm"].between(0, LENGTH).all()


def test_points_are_kept_from_half_a_cutoff_on_and_before_the_tool_leaves(built):
    _, task = built
    block = task.role("validate")[0]
    x = block.coordinates["x_mm"]
    assert x[0] == pytest.approx(4.0)
    assert x[-1] <= LENGTH - 8 * np.sin(np.pi / 3) - 4
    np.testing.assert_allclose(np.diff(x), 4.0)
    assert (block.sigma < 3e-6).all()


def test_without_an_idle_run_the_force_comes_from_the_coefficients_and_the_notes_say_so(cell):
    manifest = cell.batch.manifest | {"coefficients": COEFFICIENTS}
    other = Cell()
    other.logs = {run: table[table["log"] == "cut"] for run, table in cell.logs.items()}
    other.batch = replace(cell.batch, manifest=manifest)
    observed, task = other.task()
    assert set(observed["tip_force"]["source"]) == {"coefficients"}
    assert any("no idle_log" in note for note in task.notes)
    assert any("its own weight is not known" in note for note in task.notes)
    believed = next(block for block in task.blocks if block.belief)
    off = np.hypot(tip_force.SYSTEMATIC["coefficients"], LOADED)
    assert dict(zip(believed.axis, believed.sigma, strict=True)) == {
        **{f"softer_joint_{joint}": SOFTER for joint in range(1, 7)},
        **{f"lost_motion_joint_{joint}": TWISTED for joint in range(1, 7)},
        "wall_zero": TOUCHED,
        **{f"force_off_coefficients_{axis}": pytest.approx(off) for axis in "xyz"},
        **{f"gear_wave_{wave + 1}": 1.0 for wave in range(task.base.waves)},
        **{f"straight_joint_{joint}": OF_LINKS for joint in range(1, 7)},
    }
    straight = [name.startswith("straight_joint") for name in believed.axis]
    np.testing.assert_array_equal(believed.measured, np.where(straight, LINKS, 0.0))
    assert task.base.waves > 0


def test_the_joints_turn_as_fast_as_the_feed_takes_them_along_the_wall(cell):
    _, task = cell.task()
    feed = 0.06e-3 * 3 * 4000.0 / 60.0
    for block in task.role("identify", "validate"):
        setting = block.setting
        travelled = setting.commanded[-1] - setting.commanded[0]
        turned = np.trapezoid(setting.rate, dx=setting.spacing / feed, axis=0)
        np.testing.assert_allclose(turned, travelled, atol=0.03 * np.abs(travelled).max())
        assert np.abs(travelled).max() > 1e-3


def test_without_a_feed_in_the_run_table_walls_are_predicted_all_the_same(cell):
    other, (_, task) = Cell(), cell.task()
    other.batch = replace(other.batch, runs=other.batch.runs.assign(feed_per_tooth_mm=np.nan))
    told = other.task()[1]
    for block, known in zip(told.role("identify"), task.role("identify"), strict=True):
        matrix, offset = told.base.design(block, np.zeros(0), whole(told.base, np.full(6, 1e-6)))
        assert np.isfinite(matrix).all()
        assert np.isfinite(offset).all()
        assert not block.setting.rate.any()
        assert known.setting.rate.any()


def test_a_tool_that_yields_is_given_the_depth_that_it_really_cuts(cell):
    """The fixed point: nominal radial depth less what the wall stands proud under that depth's force."""
    batch = replace(cell.batch, manifest=cell.batch.manifest | {"coefficients": COEFFICIENTS})
    face, soft = wall(batch, "r1"), 3e-6

    def force(batch, soft):
        return tip_force.from_coefficients(batch, "r1", {}, face, lambda f: soft * float(face.normal @ f))

    found = force(batch, soft).loc[0, ["fx_n", "fy_n", "fz_n"]].to_numpy(dtype=float)
    proud = soft * float(face.normal @ found)
    assert proud > 1e-4
    shallower = replace(batch, runs=batch.runs.assign(radial_depth_mm=DEPTH - proud / MM))
    rigid = force(shallower, 0.0).loc[0, ["fx_n", "fy_n", "fz_n"]].to_numpy(dtype=float)
    np.testing.assert_allclose(found, rigid, rtol=1e-5)


@pytest.mark.parametrize(("starts", "drift"), [(1.0, 0.0), (1.0, 2.0), (0.0, 0.0)])
def test_a_dynamometer_gives_the_mean_of_the_steady_cut_about_its_air(cell, starts, drift):
    """The air after the cut is three times as long as that before, if there is any: the zero is a line."""
    rate, turn = 2000.0, 60 / 4000
    t = np.arange(0, 8, 1 / rate)
    cutting = (t >= starts) & (t < 5)
    ripple = 1 + 0.5 * np.sin(2 * np.pi * 3 / turn * t)
    record = pd.DataFrame({"t_s": t, "spindle_deg": np.nan})
    for name, mean, zero in (("fx_n", 90.0, 3.0), ("fy_n", -150.0, -2.0), ("fz_n", 40.0, 1.0)):
        record[name] = mean * ripple * cutting + zero + drift * t
    found = tip_force.from_dynamometer(
        cell.batch, "r1", FakeTables(lambda *_: record), wall(cell.batch, "r1")
    )
    np.testing.assert_allclose(found[["fx_n", "fy_n", "fz_n"]].iloc[0], [90, -150, 40], rtol=0.01)


def test_a_wall_of_unknown_side_is_refused(cell):
    other = Cell(force_scale=1.0)
    other.batch = replace(cell.batch, runs=cell.batch.runs.assign(direction="slot"))
    _, task = other.task()
    assert isinstance(task, Refusal)
    assert "which wall was traced" in task.reason


def test_reasons_are_joined_without_a_full_stop_between_them(cell, built):
    """A summary had said: no idle_log.; No tip force."""
    observed, _ = built
    refused = pd.DataFrame(
        {"run": "r1", "what": ["profile points", "tip force"], "reason": ["no profile", "no idle_log"]}
    )
    bare = dict(observed) | {"deformation_refused": refused, "profile_points": observed["profile_points"][:0]}
    refusal = deformation.problem(cell.batch, bare, {})
    assert isinstance(refusal, Refusal)
    assert refusal.reason == "No profile points of r1: no profile; No tip force of r1: no idle_log"


def test_an_arm_of_which_nothing_is_known_is_refused(cell):
    batch = replace(cell.batch, cell={"cell": "mystery"})
    refusal = deformation.observe(batch, FakeTables(cell.read), {})
    assert isinstance(refusal, Refusal)
    assert "mystery" in refusal.reason


def test_without_load_tests_the_cell_file_is_believed_to_two_percent(cell, built):
    observed, _ = built
    bare = dict(observed) | {"arm_loads": observed["arm_loads"].iloc[:0]}
    refusal = deformation.problem(cell.batch, bare, {})
    assert isinstance(refusal, Refusal)
    assert "joint_stiffness_nm_rad" in refusal.reason
    known = replace(cell.batch, cell=cell.batch.cell | {"joint_stiffness_nm_rad": list(STIFFNESS)})
    task = deformation.problem(known, bare, {})
    (block,) = (one for one in task.role("calibrate") if not one.belief)
    np.testing.assert_allclose(block.measured, 1 / STIFFNESS)
    np.testing.assert_allclose(block.sigma / block.measured, 0.02)
    assert any("within 2%" in note for note in task.notes)


def test_a_joint_that_the_load_tests_do_not_see_is_rigid_give_or_take(cell, built):
    """One pose, and only forces that pass the axis of joint 6."""
    observed, _ = built
    loads = observed["arm_loads"].copy()
    axis = cell.arm.work[:3, :3].T
    kept = []
    for _, row in loads.iterrows():
        column = moves(cell.arm, row[COLUMNS].to_numpy(dtype=float) * DEG)[:, 5]
        force = np.cross(column, axis[:, 2])
        row[["fx_n", "fy_n", "fz_n"]] = 300 * force / np.linalg.norm(force)
        moved = deflection(
            cell.arm,
            row[COLUMNS].to_numpy(dtype=float) * DEG,
            row[["fx_n", "fy_n", "fz_n"]].astype(float),
            1.0,
        )
        row[["dx_mm", "dy_mm", "dz_mm"]] = moved / MM
        kept.append(row)
    task = deformation.problem(cell.batch, dict(observed) | {"arm_loads": pd.DataFrame(kept)}, {})
    known = [block for block in task.role("calibrate") if block.run == "known joints"]
    assert len(known) == 1
    assert list(known[0].axis) == ["joint 6"]
    assert any("do not determine joint 6" in note for note in task.notes)


def test_the_report_holds_the_truth_within_its_intervals_and_is_json(cell, built):
    observed, task = built
    assert isinstance(task, Problem)
    arm = deformation.report(cell.batch, observed, {}, task, identified_fit(task, base_fit(task, 0.007)))[
        "arm"
    ]
    json.dumps(arm, allow_nan=False)
    inside = [
        low <= k <= high
        for k, (low, high) in zip(STIFFNESS, (q["ci95"] for q in arm["joint_stiffness"]), strict=True)
    ]
    assert sum(inside) >= 5
    setting = next(block.setting for block in task.blocks if isinstance(block.setting, CutWall))
    middle = len(setting.commanded) // 2
    expected = deflection(cell.arm, setting.commanded[middle], np.array([-150.0, 90.0, 40.0]), 1.0) / MM
    found = [arm["deformation"]["r1"][axis]["ci95"] for axis in "xyz"]
    assert all(low <= value <= high for value, (low, high) in zip(expected, found, strict=True))
    assert arm["tip_force"]["r1"]["x"]["value"] == pytest.approx(-150, abs=3)
    assert len(arm["observability"]["r1"]) == 6


def test_each_wall_is_reported_with_its_error_and_where_its_deformation_comes_from(cell, built):
    observed, task = built
    beta, covariance = solved(task)
    arm = deformation.report(cell.batch, observed, {}, task, BaseFit(beta, covariance, 20.0, {}))["arm"]
    for run, figures in arm["walls"].items():
        measured, predicted = figures["measured"], figures["predicted"]
        assert figures["error_percent"]["ci95"][0] < 0 < figures["error_percent"]["ci95"][1]
        assert figures["error_percent"]["value"] == pytest.approx(
            100 * (predicted["value"] / measured["value"] - 1)
        )
        normal = wall(cell.batch, run).normal
        tip = np.array([figures["tip"][axis] for axis in "xyz"])
        expected = [arm["deformation"][run][axis]["value"] for axis in "xyz"]
        np.testing.assert_allclose(tip, expected, rtol=1e-9)
        # the flange alone: the same twists on an arm without a tool
        setting = next(block.setting for block in task.blocks if block.run == run)
        moved = moves(replace(cell.arm, tool=np.zeros(3)), setting.commanded)
        force = task.base.believed_force(setting, beta).force
        torque = np.einsum("mai,ma->mi", moves(cell.arm, setting.commanded), force)
        flange = (
            np.einsum("mai,mi->ma", moved, torque * task.base.in_cut(beta))[setting.kept].mean(axis=0) / MM
        )
        np.testing.assert_allclose([figures["flange"][axis] for axis in "xyz"], flange, atol=1e-6)
        assert figures["without_flange_rotation"] == pytest.approx(normal @ flange, abs=1e-6)
        assert len(figures["curve"]["x_mm"]) == len(figures["curve"]["predicted_mm"])
        assert figures["curve"]["x_mm"][0] < 2.0


def test_what_the_load_tests_tell_of_the_joints_is_reported(cell, built):
    observed, task = built
    told = deformation.report(cell.batch, observed, {}, task, None)["arm"]["joint_observability"]
    assert len(told["relative_sd"]) == 6
    worst = int(np.argmax(told["relative_sd"])) + 1
    assert told["worst_joint"] == told["next_load"]["joint"] == worst
    assert told["next_load"]["relative_sd_after"] < told["next_load"]["relative_sd_before"]
    assert told["sentence"] in task.notes


def test_walls_and_loads_that_could_come_next_are_proposed(built):
    _, task = built
    words = [proposal.words for proposal in task.feasible]
    assert len(set(words)) == len(words)
    assert any("pose of load tests p1" in each and "with a dynamometer" in each for each in words)
    assert any("times the force" in each for each in words)
    for proposal in task.feasible:
        for block in proposal.blocks:
            matrix, _ = task.base.design(block, np.zeros(0), whole(task.base, 1 / STIFFNESS))
            assert len(matrix) == len(block.measured) == len(block.sigma)


def test_a_repeat_without_a_dynamometer_takes_the_force_of_the_one_that_had_it(cell):
    table = pd.DataFrame({"run": ["r1"] * 2, "fx_n": [1.0, 2.0], "source": ["dynamometer"] * 2})
    other = table.assign(run="r2", fx_n=9.0, source="coefficients")
    runs = cell.batch.runs.assign(condition=["a", "a", "b"])
    batch = replace(cell.batch, runs=runs)
    taken = deformation.by_repeat(batch, other, [table, other])
    assert list(taken["fx_n"]) == [1.0, 2.0]
    assert set(taken["run"]) == {"r2"}
    assert set(taken["source"]) == {"repeat"}
    apart = replace(cell.batch, runs=runs.assign(condition=["a", "c", "b"]))
    assert deformation.by_repeat(apart, other, [table, other]) is other
    assert deformation.by_repeat(batch, table, [table, other]) is table


def test_repeats_show_how_large_the_zero_of_a_trace_is(built):
    _, task = built
    walls = [replace(b, unidentified=None) for b in task.blocks if b.role in {"identify", "validate"}]
    rng = np.random.default_rng(7)

    def zero(sd, count):
        """Zero that so many walls of two conditions each show, the heights of which scatter by ``sd``."""
        made = [
            replace(walls[0], condition=f"c{i % 2}", measured=walls[0].measured + sd * rng.normal())
            for i in range(count)
        ]
        return with_zeros(made)[0].unidentified[0, 0]

    assert zero(30e-6, 400) == pytest.approx(30e-6, rel=0.1)
    assert zero(0.0, 2) == pytest.approx(ZERO)
    assert zero(0.0, 400) < 0.2 * ZERO
    verifying = [replace(walls[0], role="validate", measured=x * walls[0].measured) for x in (1.0, 9.0)]
    assert with_zeros([*verifying, walls[0]])[0].unidentified[0, 0] == pytest.approx(ZERO)


def test_an_arm_that_is_half_as_stiff_in_the_cut_bends_twice_as_far_by_its_weight(cell):
    _, task = cell.task()
    block = task.role("identify")[0]
    light = replace(block, setting=replace(block.setting, weight=None))
    beta = np.concatenate([1.0 / STIFFNESS, np.zeros(len(task.base.believed))])

    def bent(model):
        own, without = (model.design(one, np.zeros(0))[0] @ beta for one in (block, light))
        return own - without

    soft = replace(task.base, structure=Structure(0.5))
    assert np.ptp(bent(task.base)) > 1e-6
    np.testing.assert_allclose(bent(soft), 2.0 * bent(task.base), rtol=1e-9)
