"""What the report shows of the robot, on logs made here: torques by virtual work, a 0.6 Hz line."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from fake_tables import FakeTables

from metro.batch.batch import Batch
from metro.observables.arm.robot_tables import SPACING, _waves, robot_tables
from metro.observables.arm.tip_force import Log
from metro.observables.arm.tracking_tables import tracking_tables
from metro.observables.arm.wall import Wall
from metro.observables.waviness.points import IDLE, STRAYED
from metro.robot.kinematics import Arm, arm_of_cell
from metro.robot.workspace import reach
from metro.units import DEG, MM

DH = [[0, 90, 500, 250], [90, 0, 0, 610], [-180, -90, 0, 70], [0, 90, 710, 0], [0, -90, 0, 0], [0, 0, 215, 0]]
NEAR = np.array([-20.3, -13.9, -4.4, -61.7, 34.9, 56.7]) * DEG
FORCE = np.array([150.0, 90.0, 40.0])
LENGTH, FEED, PERIOD = 80.0, 5.0, 0.012
MANIFEST = {
    "tool": {"diameter_mm": 16.0, "teeth": 3},
    "tool_in_flange_mm": [212.5, 0.0, 279.91],
    "tool_axes_in_flange": [[0, 0, -1], [0, -1, 0], [-1, 0, 0]],
    "work_in_base": {"xyz_mm": [1510.0, -210.0, 590.0], "rpy_deg": [0, 0, 30]},
    "work": {"size_mm": [LENGTH, LENGTH, 20.0]},
}
ARM = arm_of_cell({"arm": {"dh": DH}}, MANIFEST)
KNOWN = {
    "arm": {"joint_stiffness": [{"value": k, "ci95": [0.98 * k, 1.02 * k]} for k in 3 * [1.5e6] + 3 * [3e5]]}
}


def log(name, share, idle_speed=1.0):
    """Rows of a log along work x; ``share`` (n,) of the force; encoders swing by 10 µm across the path."""
    rng = np.random.default_rng(len(name))
    x = np.arange(-20.0, LENGTH + 20.0, FEED * PERIOD * idle_speed)
    ends = reach(ARM, NEAR, np.array([[-20.0, 5.0, -4.0], [LENGTH + 20.0, 5.0, -4.0]]) * MM)
    nodes = np.linspace(0, 1, 40)[:, None]
    line = np.array([-20.0, 5.0, -4.0]) + nodes * [LENGTH + 40.0, 0, 0]
    path = reach(ARM, ends[0], line * MM)
    q = np.stack([np.interp(x, line[:, 0], column) for column in path.T], axis=1)
    moves = np.stack([(ARM.tip(q + 1e-6 * e) - ARM.tip(q - 1e-6 * e)) / 2e-6 for e in np.eye(6)], axis=2)
    force = FORCE * share(x)[:, None]
    torque = -np.einsum("nai,na->ni", moves, force) + 200 * np.cos(q) + rng.normal(0, 1.0, q.shape)
    time = PERIOD * np.arange(len(x))
    swing = 10e-6 * np.sin(2 * np.pi * 0.6 * time)[:, None] * np.linalg.pinv(moves)[:, :, 1]
    table = {"run": "r1", "log": name, "t_s": time}
    for i in range(6):
        table |= {f"q{i + 1}_set_deg": q[:, i] / DEG, f"tau{i + 1}_nm": torque[:, i]}
        table[f"q{i + 1}_deg"] = (q + swing + rng.normal(0, 1e-6, q.shape))[:, i] / DEG
    return pd.DataFrame(table)


@pytest.fixture(scope="module")
def tables():
    row = {"run": "r1", "role": "identify", "condition": "a", "order": 1, "direction": "down",
           "operation": "side",
           "feed_direction_deg": 0.0, "radial_depth_mm": 4.0, "pose": "p", "axial_depth_mm": 5.0,
           "feed_per_tooth_mm": 0.025, "spindle_rpm": 4000.0, "cut_length_mm": LENGTH}  # fmt: skip
    cell = {"cell": "kr", "arm": {"dh": DH}}
    batch = Batch("b", MANIFEST, cell, pd.DataFrame([row]).set_index("run"), {})
    cut = log("cut", lambda x: np.interp(x, [-7, 0, LENGTH - 7, LENGTH], [0, 1, 1, 0]))
    robot = pd.concat([cut, log("idle", lambda x: 0 * x, 1.1)], ignore_index=True)
    loads = pd.DataFrame(columns=["pose", *(f"q{i}_deg" for i in range(1, 7))], dtype=float)
    record = pd.DataFrame(columns=["t_s", "fx_n", "fy_n", "fz_n"], dtype=float)
    kept = {"robot": robot, "loads": loads, "force": record}
    return robot_tables(batch, FakeTables(lambda name, _run=None: kept[name]), KNOWN, None)


def test_the_steady_mean_is_the_force_within_its_interval(tables):
    means = tables["robot_means"].query("frame == 'work'")
    error = (means["sensorless_n"] - FORCE) / means["sensorless_sd_n"]
    assert (error.abs() < 3).all()
    assert (means["sensorless_sd_n"] < 3).all()
    assert means["dynamometer_n"].isna().all()


def test_the_tools_frame_is_that_of_an_independent_arm(tables):
    """The tool's axes by the simulated arm, which shares no code with the models."""
    from virtual_cell.arm import Arm as Independent

    by_frame = dict(tuple(tables["robot_means"].groupby("frame")))
    independent = Independent(
        np.array(DH, dtype=float),
        ARM.tool,
        np.array(MANIFEST["tool_axes_in_flange"]),
        np.ones(6),
        np.zeros(6),
    )
    middle = tables["robot_aligned"].query("log == 'cut'")["x_mm"].median()
    [q] = reach(ARM, NEAR, np.array([[middle, 5.0, -4.0]]) * MM)
    axes = ARM.work[:3, :3].T @ independent.pose(q)[1]
    work = by_frame["work"]["sensorless_n"].to_numpy()
    np.testing.assert_allclose(by_frame["tool"]["sensorless_n"], work @ axes, rtol=2e-3, atol=0.2)
    assert np.abs(by_frame["tool"]["sensorless_n"].to_numpy() - work).max() > 10.0


def test_all_joints_count_and_the_rule_of_the_paper_is_told(tables):
    joints, means = tables["robot_joints"], tables["robot_means"]
    passing = joints["index"] >= joints["threshold"]
    assert means["enough"].iloc[0] == (passing.sum() >= 3)
    assert joints["used"].sum() >= 3
    assert (joints["friction_nm"] >= 0.1 * 0.9).all()  # a tenth of 1 N m of noise, at least


def test_what_the_cut_adds_is_kept_by_bin_and_filtered(tables):
    torques = tables["robot_torques"]
    off = (torques["bin_nm"] - torques["level_nm"]) / np.sqrt(2.0)
    assert off.std() < 1.0
    assert torques.groupby("joint").size().nunique() == 1
    together = tables["robot_aligned"]
    assert set(together["log"]) == {"cut", "idle"}
    first = tables["robot_joints"].set_index("joint")["index"].idxmax()
    assert set(together["joint"]) == {first}


def test_tip_and_flange_stray_as_the_joints_make_them(tables):
    """The swing is 10 µm across the path at the tip; the flange by differences of an arm without a tool."""
    [size] = tables["robot_tracking_size"].to_dict("records")
    assert size["tip_cut_um"] == pytest.approx(10.0, abs=1.5)
    assert size["tip_idle_um"] == pytest.approx(10.0, abs=1.5)
    bare = Arm(ARM.dh, np.zeros(3), ARM.work)
    [q] = reach(ARM, NEAR, np.array([[40.0, 5.0, -4.0]]) * MM)
    moves = np.stack([(ARM.tip(q + 1e-6 * e) - ARM.tip(q - 1e-6 * e)) / 2e-6 for e in np.eye(6)], axis=1)
    at_flange = np.stack(
        [(bare.tip(q + 1e-6 * e) - bare.tip(q - 1e-6 * e)) / 2e-6 for e in np.eye(6)], axis=1
    )
    swing = np.linalg.pinv(moves)[:, 1]
    assert size["flange_cut_um"] == pytest.approx(10.0 * abs(at_flange[1] @ swing), abs=1.5)
    assert size["joint"] == np.argmax(moves[1] * swing) + 1


@pytest.mark.parametrize("joint", [2, 6])
def test_the_joint_that_strays_is_found(joint):
    """One joint alone is off its set-point; its torque goes with it."""
    t = PERIOD * np.arange(800)
    line = np.linspace([-20.0, 5.0, -4.0], [LENGTH + 20.0, 5.0, -4.0], 21) * MM
    path = reach(ARM, reach(ARM, NEAR, line[:1])[0], line)
    q = np.stack([np.interp(t / t[-1], np.linspace(0, 1, 21), column) for column in path.T], axis=1)
    error = 50e-6 * np.sin(2 * np.pi * t)[:, None] * np.eye(6)[joint - 1]
    log = Log(q, q + error, 1e5 * error, ARM.tip(q), t)
    face = Wall(np.array([1.0, 0, 0]), np.array([0, -1.0, 0]), 0.0, LENGTH * MM, 7 * MM)
    found = tracking_tables(log, Log(*[part[:0] for part in (q, q, q, line, t)]), ARM, face)
    [size] = found["robot_tracking_size"].to_dict("records")
    assert size["joint"] == joint
    assert size["share"] == pytest.approx(1.0, abs=1e-3)
    assert size["joint_um"] == pytest.approx(size["tip_cut_um"], rel=1e-3)
    assert size["correlation"] == pytest.approx(1.0, abs=1e-6)
    assert set(found["robot_tracking"]["log"]) == {"cut"}


def test_the_course_is_parted_where_the_tool_enters_and_leaves(tables):
    course = tables["robot_force"]
    steady = course.loc[course["part"] == "steady", "x_mm"]
    assert steady.min() == pytest.approx(0.0, abs=2.5)
    assert steady.max() == pytest.approx(LENGTH - 7, abs=2.5)
    assert (course.loc[course["x_mm"] < -10, "part"] == "air").all()


def test_an_idle_run_at_another_speed_is_remarked(tables):
    [remark] = tables["robot_joints"]["remark"].unique()
    assert remark.startswith("the idle run was +10.0 % faster than the cut")


def test_the_swing_of_the_path_is_a_line_of_its_frequency_and_size(tables):
    lines = tables["robot_lines"]
    [line] = lines[(lines["domain"] == "time") & (lines["axis"] == "y")].to_dict("records")[:1]
    assert line["frequency"] == pytest.approx(0.6, abs=max(0.003, 3 * line["frequency_sd"]))
    assert line["amplitude_um"] == pytest.approx(10.0, abs=0.5)
    along = lines[(lines["domain"] == "path") & (lines["axis"] == "y")].iloc[0]
    assert along["frequency"] == pytest.approx(0.6 / FEED, rel=0.01)


def test_the_map_holds_the_softest_direction_of_the_joints_as_identified(tables):
    chart = tables["arm_map"].dropna()
    middle = chart.iloc[len(chart) // 2]
    [q] = reach(ARM, NEAR, middle[["x_mm", "y_mm", "z_mm"]].to_numpy(float)[None] * MM)
    moves = np.stack([(ARM.tip(q + 1e-6 * e) - ARM.tip(q - 1e-6 * e)) / 2e-6 for e in np.eye(6)], axis=1)
    compliance = moves @ np.diag(1 / np.array(3 * [1.5e6] + 3 * [3e5])) @ moves.T
    assert middle["k_least_n_um"] == pytest.approx(1e-6 / np.linalg.eigvalsh(compliance)[-1], rel=1e-3)
    shapes = tables["arm_ellipsoids"]
    relative = shapes["sd_n_um"] / shapes["stiffness_n_um"]
    # each joint is known within 2 % (95 %): no principal stiffness is worse known than a joint
    assert (relative < 0.011).all()
    assert (relative > 0.002).all()


def test_a_machine_that_is_no_arm_has_no_tables():
    batch = Batch("b", {}, {"cell": "mill"}, pd.DataFrame(index=pd.Index([], name="run")), {})
    assert robot_tables(batch, lambda _name, _run=None: pd.DataFrame(), {}, None) == {}


@pytest.mark.parametrize("idle", [0.5, np.nan])
def test_the_waves_of_tip_and_idle_run_are_those_of_their_joints_together(idle):
    """Six joints that stray by a sixth each: the tip by the whole; without an idle run nothing is drawn."""
    x = np.arange(0.0, 60.0, SPACING / MM)
    wave = 4.0 * np.sin(2 * np.pi * x / 3.0)  # the profile's filter keeps nine tenths of it
    points = pd.DataFrame({"run": "a", "x_mm": x, "waviness_um": wave, "kept": (x > 15.0) & (x < 45.0)})
    points[[STRAYED.format(i) for i in range(1, 7)]] = np.outer(wave, np.ones(6)) / 6.0
    points[[IDLE.format(i) for i in range(1, 7)]] = idle * np.outer(wave, np.ones(6)) / 6.0
    made = Batch("b", {"instruments": {"profiler": {"cutoff_mm": 8.0}}}, {}, pd.DataFrame(), {})
    found = _waves(made, points)
    inner = found["x_mm"].between(20.0, 40.0)
    tip, told = (found.loc[inner, name].to_numpy() for name in ("tip_um", "idle_um"))
    assert tip == pytest.approx(
        0.9 * 4.0 * np.sin(2 * np.pi * found["x_mm"][inner].to_numpy() / 3.0), abs=0.4
    )
    assert np.isnan(told).all() if np.isnan(idle) else told == pytest.approx(0.5 * tip)
