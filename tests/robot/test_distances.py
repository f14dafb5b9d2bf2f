"""Distances from stations and loads on the flange, against an arm of composed rotations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_poses import COMPLIANCE, PLACE, REACH, drawn, frames, measured, rows_rad
from test_calibration import SIGMA, poses

from metro.robot.calibration.ceiling import ceiling
from metro.robot.calibration.measured import residuals, seen_of_geometry
from metro.robot.calibration.model import State, jacobian, moved, names
from metro.robot.calibration.next_poses import next_poses
from metro.robot.calibration.performance import repeated, spread
from metro.robot.calibration.poses import Poses
from metro.robot.calibration.start import placed
from metro.robot.calibration.study import calibrated, left_out

STATIONS = np.array([[1.6, -1.1, -0.2], [1.8, 1.2, 0.1], [-0.4, 1.9, 0.4]])  # m, from where the arm stands
ERRORS = np.zeros((6, 4))
ERRORS[1, 3], ERRORS[2, 1], ERRORS[3, 0] = 9e-4, -8e-4, 7e-4


def eccentric(joint, angle):
    return 5e-4 * np.sin(angle) if joint == 3 else 0.0 * angle


def by_distance(q, stations=STATIONS, sigma=SIGMA, seed=0):
    """Return what wires from stations measure of each pose, one row for each station."""
    at, count = measured(q, ERRORS, eccentric), len(stations)
    noise = sigma * np.random.default_rng(seed).standard_normal((len(q), count))
    length = np.linalg.norm(at[:, None] - (stations + PLACE), axis=2) + noise
    again = np.repeat(np.arange(len(q)), count)
    found = poses(q[again], np.full((len(again), 3), np.nan), sigma=np.full(len(again), sigma))
    found = replace(found, pose=again, distance=length.ravel(), station=np.tile(np.arange(count), len(q)))
    return placed(found, rows_rad())


def test_derivatives_of_distances_against_differences():
    rng = np.random.default_rng(3)
    rows = np.column_stack([rows_rad(), rng.normal(0, 0.02, 6)])
    state = State(rows, np.zeros(6, dtype=bool), np.eye(4), rng.normal(0, 0.1, 3), rng.normal(0, 2.0, (2, 3)))
    q = drawn(8)
    blank = np.zeros(8)
    own = Poses(q, np.zeros((8, 3)), blank, blank, blank, q, distance=blank, station=np.arange(8) % 2)
    at, derivatives = jacobian(state, q)
    shown = seen_of_geometry(state, at, own, derivatives)
    assert shown.shape == (8, 1, state.head + 30)
    for place in range(6, shown.shape[-1]):
        step = np.zeros(shown.shape[-1])
        step[place] = 1e-6
        ends = [moved(state, sign * step) for sign in (1.0, -1.0)]
        high, low = (-residuals(end, end.position(q), own) for end in ends)
        assert np.allclose(shown[..., place], (high - low) / 2e-6, atol=1e-8), names(state)[place]


@pytest.fixture(scope="module")
def found():
    own = by_distance(drawn(400, seed=5))
    return calibrated(own, rows_rad()), own


def test_three_wires_show_corrections_and_an_effect(found):
    calibration, own = found
    final = calibration.final
    assert [(one.code, one.joint) for one in final.effects] == [("eccentricity", 3)]
    value = final.values[0][0]
    assert value == pytest.approx(5e-4, abs=4.0 * np.sqrt(final.covariance[-4, -4]))
    free = np.array(names(final.state))[final.free]
    change = (final.state.rows - calibration.fits[0].state.rows).ravel()
    sd = dict(zip(free, np.sqrt(np.diag(final.covariance)), strict=False))
    place = {name: at for at, name in enumerate(names(final.state)[final.state.head :])}
    for name, truth in (("joint 2 length", 9e-4), ("joint 3 twist", -8e-4)):
        assert change[place[name]] == pytest.approx(truth, abs=4.0 * sd[name])
        assert sd[name] < 1e-4
    assert not any(name.startswith("base") for name in free)
    left = residuals(final.state, final.predicted(own), own)
    assert np.std(left) == pytest.approx(SIGMA, rel=0.1)


def test_three_stations_determine_nine_numbers_in_place_of_the_six_of_a_base(found):
    """Of the 4 n + 3 numbers that positions determine, six place the base in the instrument's frame."""
    calibration, _ = found
    assert int(calibration.determined.kept.sum()) == 4 * 6 + 3 - 6 + 9


def test_stations_are_as_far_apart_as_they_are(found):
    calibration, _ = found
    at = calibration.final.state.stations
    for first, second in ((0, 1), (0, 2), (1, 2)):
        apart = np.linalg.norm(STATIONS[first] - STATIONS[second])
        assert np.linalg.norm(at[first] - at[second]) == pytest.approx(apart, abs=1e-4)


def test_distances_of_poses_that_no_fit_saw_are_predicted_to_their_noise(found):
    _, own = found
    held = {one.kind: one for one in left_out(own, rows_rad())}
    nominal, _, effects = (np.sqrt(np.mean(each**2)) for each in held["region"].errors)
    assert nominal > 1e-4
    assert effects == pytest.approx(SIGMA, rel=0.15)
    pose = own.pose[held["random"].which]
    assert (np.unique(pose, return_counts=True)[1] == 3).all()


def test_what_stays_of_distances_does_not_repeat(found):
    calibration, own = found
    left = ceiling(calibration.final, own)
    assert left.share < 0.1
    assert left.noise_share == pytest.approx(1.0, abs=0.15)


def test_poses_to_measure_next_are_seen_from_all_stations(found):
    calibration, own = found
    q, left = next_poses(calibration.final, own, count=5)
    assert (np.abs(q) <= REACH).all()
    assert (np.diff(left) < 0.0).all()
    assert 0.9 < left[0] < 1.0  # one of 401 poses, measured no better than the others


def test_repeats_of_distances_give_the_noise_and_no_accuracy_of_positions():
    q = np.repeat(drawn(10, seed=6), 6, axis=0)
    own = by_distance(q)
    target = np.repeat(np.arange(10), 18).astype(float)
    found, freedom = spread(own, target)
    assert found == pytest.approx(SIGMA, rel=0.2)
    assert freedom == 3 * 10 * 5
    assert repeated(own, target, ()) == ()


def test_one_station_predicts_its_distances_of_other_poses_as_well():
    """A ball bar about one ball: the standard deviations of 30 parameters over 500 distances stay."""
    calibration = calibrated(by_distance(drawn(500, seed=7), STATIONS[:1]), rows_rad())
    other = by_distance(drawn(200, seed=8), STATIONS[:1], sigma=0.0)
    nominal, final = calibration.fits[0], calibration.final
    before, after = (
        np.sqrt(np.mean(residuals(fit.state, fit.predicted(other), other) ** 2)) for fit in (nominal, final)
    )
    assert before > 1e-4
    assert after < 2.0 * SIGMA * np.sqrt(30 / 500)


def test_distances_to_points_in_one_plane_are_refused():
    q = drawn(60, seed=9)
    q[:, 1:] = q[0, 1:]
    with pytest.raises(ValueError, match="in one plane at most"):
        calibrated(by_distance(q), rows_rad())


def loaded(q, payload, sigma=SIGMA):
    """Return positions where a load of ``payload`` (m,) kg at the flange bends the joints, too."""
    found = []
    for pose, mass in zip(q, payload, strict=True):
        at = frames(rows_rad(), pose)
        weight = np.array([0.0, 0.0, -9.81 * mass])
        turned = [
            COMPLIANCE[joint] * np.cross(at[-1][1] - at[joint][1], weight) @ at[joint][0].apply([0, 0, 1.0])
            for joint in range(6)
        ]
        found.append(measured((pose + turned)[None], sags=True)[0])
    return np.array(found) + sigma * np.random.default_rng(1).standard_normal((len(q), 3))


def test_a_load_in_a_part_of_the_series_shows_the_compliance_of_the_joints():
    q = drawn(400, seed=10)
    payload = np.where(np.arange(400) < 200, 0.0, 12.0)
    own = poses(q, loaded(q, payload), sigma=np.full(400, SIGMA), payload=payload)
    calibration = calibrated(own, rows_rad())
    final = calibration.final
    joints = {one.joint: at for at, one in enumerate(final.effects) if one.code == "elasticity"}
    assert sorted(joints) == [1, 2]
    for joint, at in joints.items():
        assert final.effects[at].names[-1] == "compliance"
        value, sd = final.values[at][-1], np.sqrt(np.diag(final.covariance))[final.place(at)][-1]
        assert value * 1e-3 == pytest.approx(COMPLIANCE[joint], abs=4e-3 * sd)
        assert sd * 1e-3 < 0.1 * COMPLIANCE[joint]
