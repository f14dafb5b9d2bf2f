"""Arms of seven joints, and of six on a rail, from raw files to what is identified, and to the PDF."""

import json

import numpy as np
import pandas as pd
import pytest
import yaml
from any_arm import CENTRE, FORCE, LOAD, TOOL, AnyArm, write

from metro.batch.findings import BatchError
from metro.batch.processed import Processed, read_batch
from metro.observables.arm.calibration import calibration
from metro.observables.arm.force_by_torques import force_without_dynamometer
from metro.robot.kinematics import arm_of_cell
from metro.stages.identify import identify
from metro.stages.ingest import ingest
from metro.stages.loop import loop
from metro.stages.predict import predict
from metro.stages.report import report
from metro.stages.verdict import verdict

BUDGET = {"model_form_budget": 0.007}
GATES = BUDGET | {"materiality": 0.004, "false_additions": 0.05, "held_out_gain": 3.0, "seed": 1}


@pytest.fixture(scope="module", params=["seven", "rail"])
def made(request, tmp_path_factory):
    """Name of the arm, raw folder, and processed folder of its batch."""
    place = tmp_path_factory.mktemp(request.param)
    write(place / request.param, request.param)
    ingest(place / request.param, place, place / "out", {}, "test")
    return request.param, place / request.param, place / "out"


def test_the_tip_is_where_the_arm_s_own_matrices_have_it(made):
    name, _, out = made
    arm, batch, read = AnyArm(name), read_batch(out), Processed(out)
    of_cell = arm_of_cell(batch.cell, batch.manifest)
    rows = read("robot", "r1").iloc[::100]
    q = rows[of_cell.axes.positions].to_numpy() * of_cell.axes.units
    corner = np.array(batch.manifest["work_in_base"]["xyz_mm"]) * 1e-3
    wanted = np.array([arm.point(each) for each in q]) - corner
    np.testing.assert_allclose(of_cell.tip(q), wanted, atol=1e-9)
    assert len(of_cell.axes) == 7
    assert (name == "rail") == of_cell.axes.linear[0]


def test_the_load_of_payload_csv_is_within_its_interval(made):
    _, _, out = made
    found = calibration(read_batch(out), Processed(out))["calibration"]["payload"]
    low, high = found["mass"]["ci95"]
    assert low < LOAD < high
    for axis, true in zip("xyz", CENTRE * 1e3, strict=True):
        low, high = found["centre"][axis]["ci95"]
        assert low < true < high


def test_the_force_by_the_torques_holds_the_errors_of_the_drives_joint_by_joint(made):
    """The interval is the noise's and friction's, and that of constants by their own covariance."""
    _, _, out = made
    batch, read = read_batch(out), Processed(out)
    assumed = force_without_dynamometer(batch, read, {})["tip_force_by_torques"]["r1"]
    exact = {**batch.cell, "drives": {"uncertainty": 0.0}}
    batch.cell.update(exact)
    sure = force_without_dynamometer(batch, read, {})["tip_force_by_torques"]["r1"]
    batch.cell["drives"] = {"uncertainty": 0.0, "uncertainty_by_joint": [0.03] * 7}
    own = force_without_dynamometer(batch, read, {})["tip_force_by_torques"]["r1"]

    def half(block, axis):
        return 0.5 * np.ptp(block[axis]["ci95"])

    for axis, true in zip("xyz", FORCE, strict=True):
        assert abs(assumed[axis]["value"] - true) < half(assumed, axis)
        shared = np.sqrt(half(assumed, axis) ** 2 - half(sure, axis) ** 2)
        assert shared == pytest.approx(1.96 * 0.1 * abs(assumed[axis]["value"]), rel=0.01)
    moved = np.array([half(own, axis) for axis in "xyz"]) / 1.96 / 0.03
    at_rest = np.array([half(sure, axis) for axis in "xyz"]) / 1.96 / 0.03
    mean = np.array([assumed[axis]["value"] for axis in "xyz"])
    # independent errors of the joints turn the force; of one joint alone they would be those of one factor
    assert not np.allclose(np.sqrt(moved**2 - at_rest**2), np.abs(mean), rtol=0.05)


def by_hand(folder, arm, run, constants):
    """Force on the tip from a batch's own files: currents less those of the idle run, by −Jᵀ of the middle.

    Joints that turn alone; the middle fifth of the path, where the cut is steady.
    """
    cut, idle = (pd.read_csv(folder / f"{run}-{log}.csv") for log in ("robot", "idle"))
    turning = np.flatnonzero(~arm.linear)
    currents = [f"current{i + 1}_a" for i in turning]
    middle = slice(int(0.4 * len(cut)), int(0.6 * len(cut)))
    more = (cut[currents] - idle[currents]).to_numpy()[middle].mean(axis=0) * constants[turning]
    names = list(arm.columns("q{}_{}", np.zeros((1, len(arm.rows)))))
    q = cut[names].to_numpy()[middle].mean(axis=0) * np.where(arm.linear, 1e-3, np.pi / 180)
    return np.linalg.lstsq(-arm.jacobian(q)[:, turning].T, more, rcond=None)[0], q


def by_pinocchio(arm, q, torque):
    """Force that makes ``torque`` at the joints that turn, by pinocchio's Jacobian of the tip."""
    pin = pytest.importorskip("pinocchio", reason="pinocchio (pin) is not installed (development only)")
    model, parent, place = pin.Model(), 0, pin.SE3(arm.base, np.zeros(3))
    for i, (kind, theta, alpha, d, a) in enumerate(arm.rows):
        turn = pin.SE3(pin.utils.rotate("z", np.radians(theta)), np.zeros(3))
        joint = pin.JointModelRZ() if kind == "revolute" else pin.JointModelPZ()
        parent = model.addJoint(parent, joint, place * turn, f"joint {i + 1}")
        place = pin.SE3(pin.utils.rotate("x", np.radians(alpha)), np.array([a, 0, d]) * 1e-3)
    tip = place * pin.SE3(np.eye(3), TOOL)
    number = model.addFrame(pin.Frame("tip", parent, tip, pin.FrameType.OP_FRAME))
    jacobian = pin.computeFrameJacobian(model, model.createData(), q, number, pin.LOCAL_WORLD_ALIGNED)
    return np.linalg.lstsq(-jacobian[:3, ~arm.linear].T, torque, rcond=None)[0]


@pytest.fixture(scope="module", params=["seven", "rail"])
def by_currents(request, tmp_path_factory):
    """Arm, constants of its drives (N m/A at the joint), raw folder, and what its currents say of r1."""
    place, name = tmp_path_factory.mktemp(f"{request.param}-currents"), request.param
    constants = np.array([11.0, -9.5, 8.0, 12.5, -7.0, 10.0, 6.5])
    ratio = np.array([100.0, 120.0, 100.0, 80.0, 50.0, 100.0, 60.0])
    drives = {"torque_per_ampere_nm_a": (constants / ratio).tolist(), "gear_ratio": ratio.tolist()}
    write(place / name, name, form="current{}_a", scale=constants, drives=drives | {"uncertainty": 0.02})
    payload = place / name / "payload.csv"  # of torques, which this log has not
    payload.unlink()
    ingest(place / name, place, place / "out", {}, "test")
    read = Processed(place / "out")
    found = force_without_dynamometer(read_batch(place / "out"), read, {})["tip_force_by_torques"]["r1"]
    return AnyArm(name), constants, place / name, found


def test_currents_of_seven_axes_are_a_force_by_the_transposed_jacobian(by_currents):
    """The interval holds the force that the logs were made with, and what this file computes of the files."""
    arm, constants, folder, found = by_currents
    own, _ = by_hand(folder, arm, "r1", constants)
    for axis, true, ours in zip("xyz", FORCE, own, strict=True):
        low, high = found[axis]["ci95"]
        assert low < true < high
        assert abs(found[axis]["value"] - ours) < 0.005 * np.linalg.norm(FORCE)
        assert high - low < np.linalg.norm(FORCE)


def test_the_force_by_currents_is_that_of_pinocchio_s_jacobian(by_currents):
    arm, constants, folder, found = by_currents
    own, q = by_hand(folder, arm, "r1", constants)
    torque = -arm.jacobian(q)[:, ~arm.linear].T @ own
    theirs = by_pinocchio(arm, q, torque)
    np.testing.assert_allclose(theirs, own, rtol=1e-6, atol=1e-6)
    for axis, value in zip("xyz", theirs, strict=True):
        assert abs(found[axis]["value"] - value) < 0.005 * np.linalg.norm(FORCE)


@pytest.mark.slow
def test_a_batch_of_any_arm_ends_in_a_pdf_with_its_joints(made, tmp_path):
    name, _, out = made
    reports = tmp_path / "reports"
    identify(out, BUDGET, "test")
    predict(out, BUDGET, "test")
    loop(out, reports, GATES, "test")
    verdict(out, reports, {}, "test")
    report(out, reports, {}, "test")
    arm, found = AnyArm(name), json.loads((reports / "identified.json").read_text())
    identified = found["arm"]["joint_stiffness"]
    for compliance, stiffness, linear in zip(arm.soft, identified, arm.linear, strict=True):
        assert stiffness["unit"] == ("N/m" if linear else "N m/rad")
        if stiffness["value"] is not None:
            low, high = stiffness["ci95"]
            assert low - 0.5 * (high - low) < 1.0 / compliance < high + 0.5 * (high - low)
    assert sum(one["value"] is not None for one in identified) >= 5
    assert (reports / "report.pdf").stat().st_size > 20_000


def test_a_log_or_a_table_of_another_arm_is_refused_by_its_columns(tmp_path):
    folder = tmp_path / "rail"
    write(folder, "rail", profile=False)
    cell = yaml.safe_load((folder / "cell.yaml").read_text())
    cell["arm"]["joints"] = ["revolute"] * 7
    (folder / "cell.yaml").write_text(yaml.safe_dump(cell))
    with pytest.raises(BatchError, match="the table has q1_mm to q7_deg, expected q1_deg to q7_deg"):
        ingest(folder, tmp_path, tmp_path / "out", {}, "test")
    for name in ("loads.csv", "payload.csv"):
        (folder / name).unlink()
    with pytest.raises(BatchError, match="has the positions of 7 axes, q1_mm to q7_deg, expected q1_deg"):
        ingest(folder, tmp_path, tmp_path / "out", {}, "test")


def test_a_joint_without_torque_is_named(tmp_path):
    folder = tmp_path / "seven"
    write(folder, "seven", profile=False)
    path = folder / "r2-robot.csv"
    pd.read_csv(path).drop(columns="tau7_nm").to_csv(path, index=False)
    with pytest.raises(BatchError, match="the column tau7_nm, expected tau1_nm to tau7_nm"):
        ingest(folder, tmp_path, tmp_path / "out", {}, "test")
