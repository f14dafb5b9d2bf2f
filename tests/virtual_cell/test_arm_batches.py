"""Batches of a cutting arm: force, torques, wall and load tests agree, by a kinematics written here."""

import hashlib
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml

from virtual_cell.arm_effects import ARM_EFFECTS, INSIDE, OUTSIDE, SHOWN
from virtual_cell.arm_line import line
from virtual_cell.recipes import arm
from virtual_cell.recipes.arm_draws import drawn
from virtual_cell.recipes.kr160 import ARM, NEAR_DEG

DEG, G = np.pi / 180.0, 9.81
AXES, FORCE, TAU = "xyz", ["fx_n", "fy_n", "fz_n"], [f"tau{i}_nm" for i in range(1, 7)]
SET, ACTUAL = [f"q{i}_set_deg" for i in range(1, 7)], [f"q{i}_deg" for i in range(1, 7)]
FACING = {"up": -1.0, "down": 1.0}


def flange(q, dh):
    """Rotation and origin of the flange: the product of the printed matrices (erratum mended)."""
    pose = np.eye(4)
    for (theta, alpha, d, a), angle in zip(dh, q, strict=True):
        c, s = np.cos(theta * DEG + angle), np.sin(theta * DEG + angle)
        ca, sa = np.cos(alpha * DEG), np.sin(alpha * DEG)
        pose = pose @ np.array(
            [
                [c, -s * ca, s * sa, a * c / 1e3],
                [s, c * ca, -c * sa, a * s / 1e3],
                [0, sa, ca, d / 1e3],
                [0, 0, 0, 1],
            ]
        )
    return pose[:3, :3], pose[:3, 3]


def moved_point(q, dh, point):
    """Derivative (3, 6) of a point of the flange by the joint angles, by differences."""

    def at(q):
        turn, origin = flange(q, dh)
        return turn @ point + origin

    return np.stack([(at(q + h) - at(q - h)) / 2e-6 for h in 1e-6 * np.eye(6)], axis=1)


class Batch:
    """The files of a batch, and what its manifest says."""

    def __init__(self, folder):
        self.folder = folder
        self.manifest = yaml.safe_load((folder / "batch.yaml").read_text())
        self.dh = yaml.safe_load((folder / "cell.yaml").read_text())["arm"]["dh"]
        self.runs = pd.read_csv(folder / "runs.csv").set_index("run")
        self.loads = pd.read_csv(folder / "loads.csv")
        self.tip = np.array(self.manifest["tool_in_flange_mm"]) / 1e3
        yaw = self.manifest["work_in_base"]["rpy_deg"][2] * DEG
        self.work = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
        sensor = self.manifest["instruments"]["dynamometer"]
        rows = np.zeros((3, 3))
        for i, axis in enumerate(AXES):
            word = sensor["axes"][axis]
            rows[i, AXES.index(word[-1])] = -1.0 if word.startswith("-") else 1.0
        self.to_tool = rows * (-1.0 if sensor["reads"] == "work" else 1.0)

    def table(self, run, column):
        return pd.read_parquet(self.folder / self.runs.loc[run, column])

    def force(self, run, first, last):
        """Mean force on the tool (3,), work frame, between two shares of the record, about the air's zero."""
        record = self.table(run, "dynamometer")[FORCE].to_numpy() @ self.to_tool
        count = len(record)
        return record[int(first * count) : int(last * count)].mean(axis=0) - record[:100].mean(axis=0)

    def jacobian(self, q, tip=None):
        return moved_point(q, self.dh, self.tip if tip is None else tip)

    def middle(self, run):
        """Joint angles (6,), rad, in the middle of the cut's log."""
        set_angles = self.table(run, "robot_log")[SET].to_numpy()
        return set_angles[len(set_angles) // 2] * DEG

    def torque(self, run, first, last):
        """Torque (6,) of the cut less that of the idle run at the same places, mean between two shares."""
        cut, idle = self.table(run, "robot_log"), self.table(run, "idle_log")
        joint = int(np.argmax(np.ptp(cut[SET].to_numpy(), axis=0)))
        place, order = cut[SET[joint]].to_numpy(), np.argsort(idle[SET[joint]].to_numpy())
        rest = np.stack(
            [np.interp(place, idle[SET[joint]].to_numpy()[order], idle[t].to_numpy()[order]) for t in TAU],
            axis=1,
        )
        rows = slice(int(first * len(cut)), int(last * len(cut)))
        return (cut[TAU].to_numpy() - rest)[rows].mean(axis=0)


DRAWN = {}


def made(folder, hidden, seed=5, runs=2, style="a"):
    """Make the first runs of a batch: two conditions, cut two ways, traced from a perfect zero."""
    whole = arm.drawn

    def fewer(rng, style):
        if (seed, style) not in DRAWN:
            DRAWN[seed, style] = (*whole(rng, style), rng.bit_generator.state)
        cell, bench, rng.bit_generator.state = DRAWN[seed, style]
        plans = [p for p in bench.plans if p.role == "identify"][:runs]
        return cell, arm.replace(bench, zero=0.0, plans=tuple(arm.replace(p, replicates=1) for p in plans))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(arm, "drawn", fewer)
        truth = arm.make(folder, hidden, seed, style)
    return Batch(folder), truth


def digests(folder):
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


@pytest.fixture(scope="module")
def first_run(tmp_path_factory):
    return made(tmp_path_factory.mktemp("arm") / "one", {}, runs=1)[0]


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    return made(tmp_path_factory.mktemp("arm") / "one", {})[0]


def test_torques_carry_the_force_that_the_dynamometer_reads(clean):
    for run in clean.runs.index:
        force = clean.force(run, 0.4, 0.6)
        carried = -(clean.work.T @ clean.jacobian(clean.middle(run))).T @ force
        assert np.linalg.norm(force) > 100.0
        np.testing.assert_allclose(clean.torque(run, 0.35, 0.65), carried, atol=2.5)


def test_with_the_tip_elsewhere_torques_and_load_tests_are_those_of_the_true_tip(tmp_path):
    offset = {"dx_mm": 80.0, "dy_mm": -60.0, "dz_mm": 70.0}
    batch, _ = made(tmp_path / "one", {"tool_offset_error": offset})
    true = batch.tip + np.array(list(offset.values())) / 1e3
    cell = DRAWN[5, "a"][0]
    for run in batch.runs.index:
        force = batch.force(run, 0.4, 0.6)
        q = batch.middle(run)
        carried, declared = (-(batch.work.T @ batch.jacobian(q, tip)).T @ force for tip in (true, batch.tip))
        np.testing.assert_allclose(batch.torque(run, 0.35, 0.65), carried, atol=2.5)
        assert np.abs(declared - carried).max() > 6.0
    _loads_agree(batch, true, cell.arm.stiffness)


def test_load_tests_are_those_of_elastic_joints(clean):
    cell = DRAWN[5, "a"][0]
    _loads_agree(clean, clean.tip, cell.arm.stiffness)
    assert clean.loads.pose.nunique() >= 5
    assert set(np.abs(clean.loads[FORCE].to_numpy()).max(axis=1)) == {300.0, 900.0}


def _loads_agree(batch, tip, stiffness):
    for _, row in batch.loads.iloc[::11].iterrows():
        jacobian = batch.work.T @ batch.jacobian(row[ACTUAL].to_numpy(float) * DEG, tip)
        moved = jacobian @ ((jacobian.T @ row[FORCE].to_numpy(float)) / stiffness)
        np.testing.assert_allclose(row[["dx_mm", "dy_mm", "dz_mm"]].to_numpy(float) / 1e3, moved, atol=25e-6)


def test_the_wall_stands_proud_by_what_the_joints_give_way_and_the_encoders_show(clean):
    stiffness = DRAWN[5, "a"][0].arm.stiffness
    for run, row in clean.runs.iterrows():
        log, profile = clean.table(run, "robot_log"), clean.table(run, "profile")
        psi = row.feed_direction_deg * DEG
        normal = FACING[row.direction] * np.array([-np.sin(psi), np.cos(psi), 0.0])
        jacobian = clean.work.T @ clean.jacobian(clean.middle(run))
        gives = normal @ jacobian @ ((jacobian.T @ clean.force(run, 0.4, 0.6)) / stiffness)
        some = slice(int(0.4 * len(log)), int(0.6 * len(log)))
        error = ((log[ACTUAL].to_numpy() - log[SET].to_numpy())[some] * DEG).mean(axis=0)
        middle = profile[np.abs(profile.x_mm - row.cut_length_mm / 2) < 0.1 * row.cut_length_mm]
        assert middle.z_mm.mean() / 1e3 == pytest.approx(gives + normal @ jacobian @ error, abs=2e-6)


CHANGED = {
    "clock_offset": {"robot_log"},
    "friction_reversal": {"robot_log", "profile"},
    "friction_warmup": {"robot_log"},
    "gear_ripple": {"robot_log", "profile"},
    "payload_error": {"robot_log"},
    "tool_offset_error": {"robot_log", "dynamometer", "profile", "loads"},
    "joint_backlash": {"robot_log", "dynamometer", "profile"},
    "stiffness_scale": {"robot_log", "dynamometer", "profile"},
    "stiffness_hardening": {"robot_log", "dynamometer", "profile", "loads"},
    "path_vibration": {"profile"},
    "viscous_change": {"robot_log"},
    "torque_constant": {"robot_log", "idle_log"},
    "joint_delay": {"robot_log", "idle_log"},
    "gain_drift": {"dynamometer"},
    "link_flexibility": {"robot_log", "dynamometer", "profile", "loads"},
    "tool_bending": {"robot_log", "dynamometer", "profile"},
    "thermal_drift": {"profile"},
    "wall_tilt": {"profile"},
    "fixed_length_waves": {"profile"},
    "entry_ringing": {"profile"},
    "drifting_vibration": {"profile"},
}


@pytest.mark.parametrize("name", ARM_EFFECTS)
def test_an_effect_changes_the_files_that_it_should_and_no_other(name, first_run, tmp_path):
    cell = DRAWN[5, "a"][0]
    values = ARM_EFFECTS[name].draw(np.random.default_rng(4), cell)
    hidden, truth = made(tmp_path / "one", {name: values}, runs=1)
    assert truth["effects"] == {name: values}
    first, second = digests(first_run.folder), digests(hidden.folder)
    assert first.keys() == second.keys()
    kinds = {"force": "dynamometer", "profile": "profile", "robot": "robot_log"}
    differ = set()
    for file in first:
        if first[file] != second[file]:
            kind = kinds.get(file.split("/")[0], file.removesuffix(".csv"))
            differ.add("idle_log" if file.endswith("-idle.parquet") else kind)
    assert differ == CHANGED[name]


def test_every_effect_of_the_contract_and_six_others_are_shown_somewhere():
    assert {name for names in SHOWN.values() for name in names} == set(ARM_EFFECTS)
    assert len(INSIDE) == 10
    assert all(sum(name in OUTSIDE for name in names) >= 3 for names in SHOWN.values())


def test_the_seed_decides_all_bytes(clean, tmp_path):
    DRAWN.pop((5, "a"))
    again, _ = made(tmp_path / "one", {})
    assert digests(again.folder) == digests(clean.folder)
    other, _ = made(tmp_path / "two", {}, seed=6, runs=1)
    same = set(digests(other.folder).values()) & set(digests(clean.folder).values())
    assert {k for k, v in digests(clean.folder).items() if v in same} == {"cell.yaml"}


def test_a_line_is_straight_between_its_nodes_too_and_its_turns_are_where_the_speed_changes_its_sign():
    start = np.array(NEAR_DEG) * DEG
    at, axes = ARM.pose(start)
    towards = axes @ np.array([0.6, 0.8, 0.0])
    along = line(ARM, (at, at + 0.15 * towards), axes, start)
    for s in (0.0043, 0.077, 0.1461):
        position, turned = ARM.pose(along.spline(s))
        np.testing.assert_allclose(position, at + s * towards, atol=3e-9)
        np.testing.assert_allclose(turned, axes, atol=3e-9)
    fine = np.linspace(0.0, 0.15, 3001)
    rate = along.rate(fine, 0.01)
    for joint in range(6):
        crossings = fine[1:][np.diff(np.sign(rate[:, joint])) != 0]
        assert len(along.turns[joint]) == len(crossings)
        np.testing.assert_allclose(along.turns[joint], crossings, atol=6e-5)


@pytest.mark.parametrize("style", ["a", "b"])
def test_in_half_of_the_batches_joints_turn_round_within_cuts_of_both_roles(style):
    turning = []
    for seed in range(10):
        cell, bench = drawn(np.random.default_rng([seed, 23]), style)
        turning.append(bool(cell.moves.turning))
        assert {plan.role for plan in bench.plans} == {"identify", "validate"}
        assert len({plan.feed_direction_deg for plan in bench.plans}) >= 2
        assert {plan.direction for plan in bench.plans} == {"up", "down"}
        mine, held = ({p.condition for p in bench.plans if p.role == r} for r in ("identify", "validate"))
        assert not mine & held
    assert 2 <= sum(turning) <= 8


def test_a_batch_of_style_b_passes_the_pipelines_check(tmp_path):
    check = pytest.importorskip("metro.batch.check", reason="the pipeline's check is not there")
    batch, _ = made(tmp_path / "one", {}, seed=9, style="b")
    assert not [p for p in check.check(batch.folder, batch.folder).problems if "role" not in str(p)]


def test_the_zero_of_a_trace_is_off_by_a_few_micrometres_from_run_to_run(tmp_path, monkeypatch):
    walls = []
    for off in (0.0, 3e-6):

        def only_one(rng, style, zero=off):
            cell, bench = drawn(rng, style)
            return cell, arm.replace(bench, zero=zero, plans=bench.plans[1:2])

        monkeypatch.setattr(arm, "drawn", only_one)
        arm.make(tmp_path / "one", {}, 5)
        walls.append(
            [pd.read_parquet(p).z_mm.to_numpy() for p in sorted((tmp_path / "one/profile").iterdir())]
        )
    off = 1e3 * (np.array(walls[1]) - walls[0])
    assert np.ptp(off, axis=1).max() < 0.1  # each trace as a whole
    assert len(set(off.mean(axis=1).round(2))) == 2
    assert np.abs(off).max() < 12.0


def test_the_gauge_of_the_load_tests_is_off_by_its_calibration():
    """The force that is written down is not the one that moves the tip."""
    cell, bench = drawn(np.random.default_rng(5), "b")
    assert 0.0 < np.abs(bench.calibration).max() < 0.05
    moved = []
    for error in (0.0, 0.1):
        exact = replace(bench, tracker=0.0, calibration=np.array([0.0, 0.0, 0.0, error]))
        rows = pd.DataFrame(arm.tested(cell, exact, np.random.default_rng(1)))
        moved.append(rows[["dx_mm", "dy_mm", "dz_mm"]].to_numpy())
    np.testing.assert_allclose(moved[1], 1.1 * moved[0], atol=2e-4)
