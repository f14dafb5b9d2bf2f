"""Joint logs of a free motion, from files to what is identified: with an arm, without, in amperes."""

import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from metro.batch.findings import BatchError
from metro.batch.processed import Processed, read_batch
from metro.cli import app
from metro.observables.arm.joint_logs import observe
from metro.robot.kinematics import geometry_of_cell
from metro.robot.rigid_body import torque_regressor
from metro.stages.ingest import ingest
from metro.stages.whole import check_whole

ROOT = Path(__file__).parents[2]
FIELD = Path(os.environ.get("METRO_REAL_DATA", ROOT / "../shared/real")).parent / "field"
PAIR = FIELD / "robot-ur10e-payload"
TRUE = 2.805  # kg
PUBLISHED = np.array([12.5, 13.3, 5.0, 2.0, 2.69, 2.30]), np.array([21.3, 20.2, 10.4, 3.6, 2.5, 3.0])
PANDA = """cell: panda
arm:
  convention: modified
  joints: [revolute, revolute, revolute, revolute, revolute, revolute, revolute, fixed]
  dh:
  - [0, 0, 333, 0]
  - [0, -90, 0, 0]
  - [0, 90, 316, 0]
  - [0, 90, 0, 82.5]
  - [0, -90, 384, -82.5]
  - [0, 90, 0, 0]
  - [0, 90, 0, 88]
  - [0, 0, 107, 0]
"""
LOAD = np.array([1.5, 0.03, 0.02, 0.12, 0.02, 0, 0, 0.02, 0, 0.01])
TIME = np.arange(0, 30, 0.01)


def motion():
    rng = np.random.default_rng(3)
    q, rate, rise = (np.zeros((len(TIME), 7)) for _ in range(3))
    for k in range(1, 6):
        pulse, size, phase = 2 * np.pi * k / 15, rng.uniform(0.15, 0.45, 7) / np.sqrt(k), rng.uniform(0, 6, 7)
        angle = pulse * TIME[:, None] + phase
        q, rate = q + size * np.sin(angle), rate + size * pulse * np.cos(angle)
        rise = rise - size * pulse**2 * np.sin(angle)
    return q + np.array([0, -0.5, 0, -1.8, 0, 1.6, 0.4]), rate, rise


def seven(folder, cell=PANDA, drive="tau{}_nm", columns=lambda table: table, runs=None):
    """Write a batch of a seven-axis arm with and without a load of 1.5 kg."""
    import yaml

    folder.mkdir()
    q, rate, rise = motion()
    links = torque_regressor(geometry_of_cell(yaml.safe_load(PANDA)), q, rate, rise)
    own = links @ np.tile([3, 0.3, 0.1, 0.2, 0.06, 0, 0.01, 0.06, 0, 0.05], 7)
    noise = 0.1 * np.random.default_rng(4).normal(size=(2, *q.shape))
    for name, loaded, more in (("bare", 0.0, noise[0]), ("load", 1.0, noise[1])):
        torque = own + loaded * links[..., -10:] @ LOAD + 2 * np.sign(rate) + 3 * rate + more
        table = pd.DataFrame({"t_s": TIME})
        for i in range(7):
            table[f"q{i + 1}_set_deg"] = np.degrees(q[:, i] + 1e-4 * rate[:, i])
            table[f"q{i + 1}_deg"] = np.round(np.degrees(q[:, i]), 3)
            table[drive.format(i + 1)] = torque[:, i]
        columns(table).to_csv(folder / f"{name}.csv", index=False)
    (folder / "cell.yaml").write_text(cell)
    (folder / "batch.yaml").write_text(f"format: 1\nbatch: {folder.name}\nsource: simulated\ncell: panda\n")
    (folder / "runs.csv").write_text(runs or "run,joint_log,loaded\nbare,bare.csv,no\nload,load.csv,yes\n")
    return folder


def observed(folder, out):
    ingest(folder, ROOT / "config/cells", out, {}, "test")
    return observe(read_batch(out), Processed(out))


def test_a_seven_axis_arm_tells_friction_load_and_how_it_follows(tmp_path):
    cell = f"{PANDA}drives: {{uncertainty: 0.01}}\n"
    tables, blocks = observed(seven(tmp_path / "seven", cell), tmp_path / "out")
    payload = blocks["calibration"]["payload"]
    low, high = payload["mass"]["ci95"]
    assert low < 1.5 < high
    assert high - low == pytest.approx(2 * 2.045 * 0.01 * 1.5, rel=0.2)
    for axis, true in zip("xyz", 1000 * LOAD[1:4] / LOAD[0], strict=True):
        low, high = payload["centre"][axis]["ci95"]
        assert low < true < high
    bare = blocks["joints"]["runs"]["bare"]
    assert [found["value"] for found in bare["coulomb"]] == pytest.approx([2.0] * 7, abs=0.05)
    log = tables["joint_log"]
    assert (log["tracking_mdeg"] > 0).all()
    assert (log.groupby("run")["flange_um"].first() > 0).all()
    assert "1 % standard uncertainty shared by all joints" in payload["drives"]


def test_currents_without_constants_are_said_in_amperes_and_tell_no_mass(tmp_path):
    folder = seven(tmp_path / "amperes", drive="current{}_a")
    tables, blocks = observed(folder, tmp_path / "out")
    assert set(tables["joint_log"]["unit"]) == {"A"}
    assert blocks["joints"]["runs"]["bare"]["viscous"][0]["unit"] == "A s/rad"
    assert "torque_per_ampere" in blocks["calibration"]["not_identified"]["payload"]


def test_without_an_arm_the_motion_is_described_and_nothing_is_called_friction(tmp_path):
    folder = seven(tmp_path / "alone", cell="cell: panda\n")
    tables, blocks = observed(folder, tmp_path / "out")
    assert "coulomb" not in tables["joint_log"]
    assert tables["joint_log"]["remark"].str.contains("arm.dh or arm.urdf").all()
    assert "friction" in blocks["joints"]["not_identified"]
    assert check_whole(folder).ok


def test_a_short_log_and_joints_that_stand_still_are_said(tmp_path):
    tables, blocks = observed(
        seven(tmp_path / "short", columns=lambda table: table.head(40)), tmp_path / "out"
    )
    assert tables["joint_log"]["remark"].str.contains("40 samples, at least 200").all()
    assert blocks["calibration"]["not_identified"]["payload"]

    def still(table):
        table["q3_deg"] = 10.0
        table["q3_set_deg"] = 10.0
        return table

    tables, _ = observed(seven(tmp_path / "still", columns=still), tmp_path / "out2")
    third = tables["joint_log"].set_index(["run", "joint"]).loc[("bare", 3)]
    assert third["remark"] == "too slow for the encoder to resolve the direction"
    assert np.isnan(third["coulomb"])


def test_a_log_whose_axes_are_not_those_of_the_cell_is_refused_by_its_numbers(tmp_path):
    folder = seven(
        tmp_path / "six", columns=lambda table: table.drop(columns=[c for c in table if "7_" in c])
    )
    with pytest.raises(BatchError, match="positions of 6 axes, q1_deg to q6_deg, expected q1_deg to q7_deg"):
        observed(folder, tmp_path / "out")


def test_friction_that_falls_as_a_joint_warms_has_its_size_and_unit_in_identified_json(tmp_path):
    def warm(table):
        warmth = 30.0 + 8.0 * np.sin(2 * np.pi * TIME / 22.0)
        torque = table["tau1_nm"] - 0.15 * (warmth - 30.0) * np.gradient(np.radians(table["q1_deg"]), TIME)
        return table.assign(temperature1_c=warmth, tau1_nm=torque)

    _, blocks = observed(seven(tmp_path / "warm", columns=warm), tmp_path / "out")
    for run in ("bare", "load"):
        [found] = blocks["joints"]["runs"][run]["beyond"]
        assert (found["joint"], found["by"]) == (1, "viscous_temperature")
        assert found["value"]["unit"] == "N m s/(rad K)"
        low, high = found["value"]["ci95"]
        assert low < -0.15 < high


@pytest.mark.skipif(not PAIR.is_dir(), reason="the field files are not there")
def test_the_pair_of_a_ur10e_is_imported_and_its_interval_holds_the_mass(tmp_path):
    given = {
        "joints.drive": "14-19",
        "unit.drive": "A",
        "unit.time": "s",
        "unit.angle": "rad",
        "loaded": "no,yes",
        "cell": "ur10e",
        "drives.torque_per_ampere_nm_a": "10.0,10.70,8.46,9.00,9.48,10.12",
    }
    answers = [f"--set={key}={value}" for key, value in given.items()]
    files = [str(path) for path in sorted(PAIR.glob("*.csv"))]
    result = CliRunner().invoke(app, ["import", *files, f"--out={tmp_path / 'pair'}", *answers])
    assert result.exit_code == 0, result.output
    _, blocks = observed(tmp_path / "pair", tmp_path / "out")
    payload = blocks["calibration"]["payload"]
    low, high = payload["mass"]["ci95"]
    assert low < TRUE < high
    assert payload["mass"]["value"] == pytest.approx(2.46, abs=0.03)  # published from this pair
    alone = payload["mass_by_logs_alone"]["ci95"]
    assert high - low > 10 * (alone[1] - alone[0])  # the drives are most of it
    bare = blocks["joints"]["runs"]["r01"]
    for name, published in zip(("coulomb", "viscous"), PUBLISHED, strict=True):
        ends = np.array([found["ci95"] for found in bare[name]])
        assert ((ends[:, 0] < published) & (published < ends[:, 1])).all()


def test_an_answer_is_asked_for_the_drives_of_a_log_without_names(tmp_path):
    q, rate, _ = motion()
    table = np.column_stack([TIME, q, rate, np.random.default_rng(1).normal(size=q.shape)])
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", fmt="%.6f")
    result = CliRunner().invoke(app, ["import", str(tmp_path / "log.csv"), f"--out={tmp_path / 'x'}"])
    assert "joints.drive" in result.output
    assert "of the 7 joints" in result.output


def test_names_of_a_joint_log_are_read_as_they_are(tmp_path):
    q, rate, _ = motion()
    names = [f"actual_q_{i}" for i in range(7)], [f"actual_current_{i}" for i in range(7)]
    table = pd.DataFrame({"timestamp": TIME, **dict(zip(names[0], q.T, strict=True))})
    table = table.assign(**dict(zip(names[1], (rate * 3 + 0.1 * np.sin(TIME * 9)[:, None]).T, strict=True)))
    table.to_csv(tmp_path / "rtde.csv", index=False)
    given = {"unit.time": "s", "unit.angle": "rad", "unit.current": "A", "loaded": "none", "cell": "none"}
    answers = [f"--set={key}={value}" for key, value in given.items()]
    result = CliRunner().invoke(
        app, ["import", str(tmp_path / "rtde.csv"), f"--out={tmp_path / 'x'}", *answers]
    )
    assert result.exit_code == 0, result.output
    assert 'current7_a: {from: "actual_current_6", unit: "A"}' in (tmp_path / "x/batch.yaml").read_text()
