"""What a calibrated arm is good for: what it leaves, of which kind; corrected targets; the arm itself."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simulated_poses import COMPLIANCE, ROWS, TRACKER, drawn, frames, gravity_torques, measured, rows_rad
from test_calibration import SIGMA, poses

from metro.batch.batch import Batch
from metro.observables.poses.calibrated_arm import calibrated_chain, with_calibrated_arm
from metro.robot.calibration.ceiling import ALONE, POSE, TIME, ceiling
from metro.robot.calibration.compensation import corrected
from metro.robot.calibration.fit import Fit
from metro.robot.calibration.model import State
from metro.robot.calibration.performance import spread
from metro.robot.calibration.rounding import moved_by_rounding, steps
from metro.robot.calibration.study import calibrated, left_out
from metro.robot.chain import chain, of_rows
from metro.robot.kinematics import forward, geometry_of_cell
from virtual_cell.tracked_arm import TrackedArm

ERRORS = np.zeros((6, 4))
ERRORS[1] = [0.0011, -0.0006, 0.0, 0.0007]
ERRORS[2] = [-0.0008, 0.0009, 0.0, -0.0005]
ERRORS[4, 3] = 0.0004


def eccentric(joint, angle):
    return 4e-4 * np.sin(angle) - 2e-4 * np.cos(2 * angle) if joint == 3 else 0.0 * angle


def arm(q, sigma=0.0, seed=0):
    return measured(q, ERRORS, eccentric, sags=True, sigma=sigma, seed=seed)


@pytest.fixture(scope="module")
def found():
    q = drawn(400, seed=8)
    own = poses(q, arm(q, SIGMA))
    return calibrated(own, rows_rad()), left_out(own, rows_rad()), own


def test_corrected_targets_take_the_true_arm_to_where_the_nominal_one_has_the_point(found):
    """The nominal place is that of the arm without errors, laid on what was measured by least squares."""
    calibration, held, own = found
    targets = drawn(300, seed=99)
    one = corrected(targets, calibration.fits[0], calibration.final, own, held)
    wanted = calibration.fits[0].state.position(targets)
    before, after = (np.linalg.norm(arm(q) - wanted, axis=1) for q in (targets, one.q))
    assert np.median(before) > 6e-4
    assert np.median(after) < 1.5e-5
    assert np.max(np.abs(one.before - before)) < 1e-4
    seen = np.linalg.norm(arm(one.q, SIGMA, seed=3) - wanted, axis=1)
    assert np.median(one.after[:, 0]) == pytest.approx(np.median(seen), rel=0.15)
    low, high = one.after[:, 1], one.after[:, 2]
    assert 0.91 < np.mean((low < seen) & (seen < high)) < 0.985
    assert np.max(one.left) < 2e-6


def test_corrected_targets_keep_the_flange_turned_as_the_nominal_arm_has_it(found):
    """Turns in the frame of the tracker; a constant turn of the flange is what a point cannot show."""
    calibration, held, own = found
    targets = drawn(60, seed=98)
    one = corrected(targets, calibration.fits[0], calibration.final, own, held)
    nominal = Rotation.from_matrix(calibration.fits[0].state.frames(targets)[0][-1][:, :3, :3])
    off = []
    for q in (targets, one.q):
        angles = q + [[eccentric(j, a) for j, a in enumerate(p)] for p in q]
        rows = rows_rad() + ERRORS
        angles = angles + [COMPLIANCE * gravity_torques(rows, p) for p in q]
        true = Rotation.concatenate([TRACKER * frames(rows, p)[-1][0] for p in angles])
        between = nominal.inv() * true
        off.append(np.median((between.mean().inv() * between).magnitude()))
    assert off[0] > 5e-4
    assert off[1] < 1e-4


def test_what_targets_beyond_the_poses_are_named(found):
    calibration, held, own = found
    targets = drawn(20, seed=97)
    targets[0, 2] = 1.6
    one = corrected(targets, calibration.fits[0], calibration.final, own, held)
    assert not one.inside[0]
    assert one.inside[1:].mean() > 0.8
    assert one.after[0, 2] > np.median(one.after[1:, 2])


def test_noise_alone_has_no_ceiling():
    q = drawn(600, seed=21)
    own = poses(q, measured(q, sigma=SIGMA, seed=4), sigma=np.full(600, SIGMA))
    found = ceiling(calibrated(own, rows_rad()).final, own)
    assert found.parts[ALONE] > 0.85
    assert found.ci95[0] <= 0.0
    assert found.noise_share == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(
    ("kind", "hidden"),
    [
        ("joint 2", lambda q, _time: (2e-4 * np.sin(150 * q[:, 1]), 0.0)),
        (POSE, lambda q, _time: (0.0 * q[:, 0], 1.5e-4 * np.sin(2 * q[:, [0, 1, 2]] + 2 * q[:, [1, 2, 0]]))),
        (TIME, lambda q, time: (0.0 * q[:, 0], 1e-4 * np.sin(5 * time[:, None] + np.arange(3)))),
    ],
)
def test_a_cause_that_no_effect_has_shows_as_its_kind(kind, hidden):
    """A ripple that a curve's knots cannot follow, a warp over the pose, a wave in time."""
    q = drawn(900, seed=22)
    turned, moved = hidden(q, np.linspace(0, 2 * np.pi, 900))
    true = q.copy()
    true[:, 1] += turned
    own = poses(q, measured(true, sigma=SIGMA, seed=5) + moved)
    one = ceiling(calibrated(own, rows_rad()).fits[1], own)
    assert next(iter(one.parts)) == kind
    assert one.ci95[0] > 0.15
    assert one.share < one.ci95[1] <= 1.0
    assert one.noise_share is None


def test_the_calibrated_arm_is_the_true_one_where_the_cell_has_the_declared():
    q = drawn(400, seed=23)
    errors = ERRORS * (np.arange(6) < 4)[:, None]
    own = poses(q, measured(q, errors, sigma=1e-6))
    cell = {"cell": "arm", "arm": {"dh": (ROWS * (1, 1, 1e3, 1e3)).tolist()}, "drives": {"x": 1}}
    declared = geometry_of_cell(cell)
    made = calibrated_chain(calibrated(own, declared).final, declared)
    batch = with_calibrated_arm(Batch("b", {}, cell, None, {}), {"pose": {"r01": {"arm": made}}})
    assert batch.cell["drives"] == {"x": 1}
    geometry = geometry_of_cell(batch.cell)
    true = np.array([frames(rows_rad() + errors, p)[-1][1] for p in q[:50]])
    before, after = (forward(each, q[:50])[:, :3, 3] - true for each in (declared, geometry))
    assert np.sqrt(np.mean(before**2)) > 5e-4
    off = after - after.mean(axis=0)
    assert np.sqrt(np.mean(off**2)) < 0.2 * np.sqrt(np.mean((before - before.mean(axis=0)) ** 2))


def test_the_tilt_of_parallel_axes_is_in_the_calibrated_arm():
    rows = np.column_stack([rows_rad() + ERRORS, np.zeros(6)])
    rows[1, 4] = 7e-4
    state = State(rows, np.zeros(6, dtype=bool), np.eye(4), np.zeros(3))
    fit = Fit(state, np.zeros(39, dtype=bool), (), (), 0.0, np.zeros((0, 0)))
    geometry = geometry_of_cell({"arm": {"chain": calibrated_chain(fit, rows_rad())}})
    true = TrackedArm(rows, np.zeros(3), np.zeros(6), np.zeros(6))
    for q in drawn(5, seed=26):
        turn, origin = true.frames(q)[-1]
        assert np.allclose(forward(geometry, q)[:3, 3], origin, atol=1e-12)
        assert np.allclose(forward(geometry, q)[:3, :3], turn.as_matrix(), atol=1e-12)


def test_without_errors_the_calibrated_arm_is_the_declared_one_in_any_convention():
    rng = np.random.default_rng(5)
    rows = np.column_stack([rng.uniform(-1, 1, (6, 2)), rng.uniform(0.1, 0.5, (6, 2))])
    geometry = chain(of_rows(rows, ["prismatic", *["revolute"] * 5], modified=True))
    q = rng.uniform(-1, 1, (200, 6))
    flange = forward(geometry, q)
    at = flange[:, :3, 3] + flange[:, :3, :3] @ [0.1, 0.05, 0.2]
    made = calibrated_chain(calibrated(poses(q, at), geometry).final, geometry)
    again = geometry_of_cell({"arm": {"chain": made}})
    assert np.allclose(forward(again, q), flange, atol=1e-7)
    assert again.prismatic.tolist() == [True] + [False] * 5


def test_a_batch_without_poses_keeps_its_arm():
    batch = Batch("b", {}, {"arm": {"dh": [[0, 0, 0, 0]]}}, None, {})
    assert with_calibrated_arm(batch, {"pose": {"not_identified": {"r01": "few"}}}) is batch


def test_the_spread_of_repeats_is_that_of_each_pose_about_its_mean():
    rng = np.random.default_rng(6)
    q = np.repeat(drawn(30), 8, axis=0)
    at = np.repeat(rng.normal(0, 1, (30, 3)), 8, axis=0) + 2e-5 * rng.standard_normal((240, 3))
    one, freedom = spread(poses(q, at, came=np.zeros_like(q)), np.repeat(np.arange(30.0), 8))
    assert freedom == 30 * 21
    assert one == pytest.approx(2e-5, rel=0.1)
    assert spread(poses(q, at), np.full(240, np.nan)) == (0.0, 0)


def test_the_rounding_of_readings_is_found_with_what_it_makes_of_the_scatter():
    """The arm goes to where it is told, and the log has hundredths of a degree."""
    q = drawn(500, seed=24)
    step = np.deg2rad(0.01)
    own = poses(np.round(q / step) * step, measured(q, sigma=1e-6))
    fit = calibrated(own, rows_rad()).final
    found, moves = moved_by_rounding(fit, own)
    assert found == pytest.approx(np.full(6, step), rel=1e-6)
    assert moves == pytest.approx(fit.scale, rel=0.1)


def test_readings_that_are_not_rounded_or_programmed_have_no_step():
    q = drawn(500, seed=25)
    q[:, 2] = np.deg2rad(np.random.default_rng(0).integers(-3, 3, 500) * 15.0)
    assert steps(q).tolist() == [0.0] * 6
