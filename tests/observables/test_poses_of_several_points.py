"""Poses with orientations or several points, against an arm of composed rotations."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation
from simulated_poses import PLACE, TOOL, TRACKER, drawn, frames, measured, rows_rad

from metro.observables.poses.rows import misread, poses_of
from metro.robot.calibration.held_out import held_out
from metro.robot.calibration.study import calibrated

MOUNT = Rotation.from_euler("xyz", [0.4, -0.8, 2.1])  # of the measured frame on the flange
ERRORS = np.zeros((6, 4))
ERRORS[1, 3], ERRORS[4, 0], ERRORS[4, 1] = 8e-4, 9e-4, -7e-4
BLANK = [
    *("q7_deg", "q8_deg", "q9_deg", "rx_deg", "ry_deg", "rz_deg", "q1", "q2", "q3", "q4"),
    *("t_s", "temperature_c", "sigma_mm", "target", "point", "distance_mm", "station", "payload_kg"),
    *("sigma_x_mm", "sigma_y_mm", "sigma_z_mm"),
]


def eccentric(joint, angle):
    return 6e-4 * np.sin(angle) if joint == 5 else 0.0 * angle


def turned(q, seed=3):
    """Return the orientations that a tracker sees, with 0.1 mrad of noise about each axis."""
    rows = rows_rad() + ERRORS
    angles = q + [[eccentric(j, a) for j, a in enumerate(p)] for p in q]
    noise = Rotation.from_rotvec(np.random.default_rng(seed).normal(0, 1e-4, (len(q), 3)))
    return noise * Rotation.concatenate([TRACKER * frames(rows, p)[-1][0] * MOUNT for p in angles])


def table(q, orientation=None, **more):
    """Return a canonical table; ``orientation``: order of the angles, or "quaternion"."""
    at = measured(q, ERRORS, eccentric, sigma=3e-5)
    rows = pd.DataFrame(np.rad2deg(q), columns=[f"q{i}_deg" for i in range(1, 7)])
    rows[["x_mm", "y_mm", "z_mm"]] = at * 1e3
    rows[BLANK] = np.nan
    if orientation == "quaternion":
        rows[["q2", "q3", "q4", "q1"]] = turned(q).as_quat()
    elif orientation:
        rows[[f"r{axis}_deg" for axis in orientation.lower()]] = turned(q).as_euler(orientation, degrees=True)
    return rows.assign(**more)


@pytest.mark.parametrize("orientation", ["xyz", "ZYX", "YXZ", "quaternion"])
def test_orientations_are_two_more_points_whatever_they_are_stated_by(orientation):
    q = drawn(20, seed=1)
    poses, target = poses_of(table(q, orientation), "xyz" if orientation == "quaternion" else orientation)
    beside = (poses.at[1::3] - poses.at[::3]) / 0.1
    assert np.allclose(beside, turned(q).as_matrix()[:, :, 0], atol=1e-9)
    assert poses.point.tolist() == [0, 1, 2] * 20
    assert poses.pose.tolist() == np.repeat(np.arange(20), 3).tolist()
    assert len(poses.first) == 20
    assert np.isnan(target).all()


def test_an_orientation_shows_the_last_joint_which_a_point_on_its_axis_does_not():
    """With it 4 n + 9 parameters are determined: each axis is a line, three points are on the flange."""
    q = drawn(300, seed=2)
    whole = calibrated(poses_of(table(q, "quaternion"))[0], rows_rad())
    alone = calibrated(poses_of(table(q))[0], rows_rad())
    assert (int(whole.final.free.sum()), int(alone.final.free.sum())) == (33, 27)
    (effect,) = whole.final.effects
    assert (effect.code, effect.joint) == ("eccentricity", 5)
    value, sd = whole.final.values[0][0], np.sqrt(whole.final.covariance[-4, -4])
    assert abs(value - 6e-4) < 3.0 * sd < 1e-4
    size = np.linalg.norm(whole.final.state.tool[1:] - whole.final.state.tool[0], axis=1)
    assert size == pytest.approx([0.1, 0.1], abs=1e-4)


def test_no_pose_is_parted_when_some_are_left_out():
    q = drawn(120, seed=4)
    poses, _ = poses_of(table(q, "xyz"))
    seen = []

    def fits(some):
        seen.append(some.pose)
        return (calibrated(poses, rows_rad()).fits[0],)

    for one in held_out(poses, fits):
        assert (poses.point[one.which] == 0).all()
    for kept in seen:
        assert set(np.bincount(kept)[np.unique(kept)]) == {3}


def test_two_reflectors_on_the_flange_are_two_points():
    q = np.repeat(drawn(150, seed=5), 2, axis=0)
    rows = table(q, point=np.tile([1, 2], 150))
    other = TOOL + np.array([0.0, 0.12, -0.03])
    second = []
    for pose in q[1::2]:
        angles = pose + [eccentric(joint, angle) for joint, angle in enumerate(pose)]
        turn, origin = frames(rows_rad() + ERRORS, angles)[-1]
        second.append(TRACKER.apply(origin + turn.apply(other)) + PLACE)
    rows.loc[1::2, ["x_mm", "y_mm", "z_mm"]] = np.array(second) * 1e3
    poses, _ = poses_of(rows)
    assert poses.pose.tolist() == np.repeat(np.arange(150), 2).tolist()
    found = calibrated(poses, rows_rad()).final.state.tool
    assert np.linalg.norm(found[1] - found[0]) == pytest.approx(np.linalg.norm(other - TOOL), abs=1e-4)


def test_angles_in_another_order_than_stated_are_named_with_the_right_one():
    rows = table(drawn(80, seed=6), "ZYX")
    assert misread(rows, "ZYX", rows_rad()) == ""
    assert misread(rows, "xyz", rows_rad()) == ""  # the same turn
    said = misread(rows, "zyx", rows_rad())
    assert "in the order xyz (about turning axes ZYX): state instruments.tracker.euler" in said
    assert misread(table(drawn(80, seed=6), "quaternion"), "zyx", rows_rad()) == ""


def test_the_uncertainty_of_a_pose_is_that_of_its_coordinates():
    rows = table(drawn(3), sigma_x_mm=0.03, sigma_y_mm=0.0, sigma_z_mm=0.04, sigma_mm=[np.nan, np.nan, 0.1])
    assert poses_of(rows)[0].sigma * 1e3 == pytest.approx([0.05 / np.sqrt(3), 0.05 / np.sqrt(3), 0.1])


def test_an_orientation_beside_a_distance_is_left_out():
    rows = table(drawn(20, seed=1), "xyz", distance_mm=1500.0).assign(x_mm=np.nan, y_mm=np.nan, z_mm=np.nan)
    poses, _ = poses_of(rows, "xyz")
    assert poses.by_distance
    assert len(poses) == 20
