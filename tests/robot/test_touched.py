"""Tool and work from touched points: exact without noise, within the stated interval as often as it says."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import t as student

from metro.robot.orientation import matrix_of_euler
from metro.robot.touched import Touches, calibrate

TIP = np.array([0.2125, 0.0, 0.27991])  # [F] table 4
ORIGIN, ANGLES = np.array([2.31256, -0.32062, 0.0795]), np.radians([0.05, 0.03, -88.40])  # [F] section 2.5
SIGMA = 2e-5
POINTS = {
    "primary": [(0.05, 0.02, 0), (0.45, 0.03, 0), (0.25, 0.09, 0), (0.1, 0.08, 0), (0.4, 0.09, 0)],
    "secondary": [(0.05, 0, -0.004), (0.45, 0, -0.005), (0.25, 0, -0.006)],
    "tertiary": [(0, 0.02, -0.005), (0, 0.08, -0.004)],
}


def touched(rng, noise=SIGMA, stated=True, fixed=6, faces=POINTS):
    """Draw flange poses that bring the tip to a fixed point and to faces of a work in the published place."""
    down = Rotation.from_euler("x", 180, degrees=True)
    turns, places, what = [], [], []

    def touch(point, turn, name):
        turns.append(turn.as_matrix())
        places.append(point - turn.as_matrix() @ TIP + noise * rng.normal(size=3))
        what.append(name)

    for _ in range(fixed):
        tilted = Rotation.from_rotvec(rng.uniform(-0.6, 0.6, 3)) * down
        touch(np.array([1.8, 0.2, 0.4]), tilted, "pin")
    for face, points in faces.items():
        for point in points:
            touch(
                ORIGIN + matrix_of_euler(ANGLES) @ np.array(point),
                Rotation.from_euler("z", 30, degrees=True) * down,
                face,
            )
    sigma = np.full(len(what), noise if stated else np.nan)
    return Touches(np.array(turns), np.array(places), what, sigma)


def test_without_noise_tool_and_work_are_recovered():
    found = calibrate(touched(np.random.default_rng(1), noise=1e-12, stated=False))
    assert found.tip == pytest.approx(TIP, abs=1e-9)
    assert found.frame[0] == pytest.approx(ORIGIN, abs=1e-8)
    assert found.frame[1] == pytest.approx(ANGLES, abs=1e-8)


@pytest.mark.parametrize("stated", [True, False])
def test_intervals_hold_the_truth_as_often_as_they_say(stated):
    """Were the nine quantities one, 95 of 100 repeats of 150 draws would hold 91.5 to 98.5 %."""
    rng, held = np.random.default_rng(7), []
    for _ in range(150):
        found = calibrate(touched(rng, stated=stated))
        off = np.concatenate([found.tip - TIP, found.frame[0] - ORIGIN, found.frame[1] - ANGLES])
        variance = np.concatenate([np.diag(found.tip_covariance), np.diag(found.frame_covariance)])
        reach = 1.96 if stated else student.ppf(0.975, found.dof)
        held.append(np.abs(off) < reach * np.sqrt(variance))
    assert np.mean(held) == pytest.approx(0.95, abs=0.035)


def test_the_error_of_the_tip_is_in_that_of_the_work():
    rng = np.random.default_rng(3)
    joint = calibrate(touched(rng))
    known = calibrate(touched(rng, fixed=0), TIP)
    assert (np.diag(joint.frame_covariance) > np.diag(known.frame_covariance)).all()
    assert known.tip_covariance == pytest.approx(np.zeros((3, 3)))


def test_many_touches_of_one_point_have_the_covariance_of_the_closed_form():
    """No turn and the three half turns have the mean zero, so that tip and point separate."""
    turns = np.array([np.eye(3), np.diag([1.0, -1, -1]), np.diag([-1.0, 1, -1]), np.diag([-1.0, -1, 1])] * 3)
    places = np.array([1.0, 0, 0]) - turns @ TIP
    found = calibrate(Touches(turns, places, ["pin"] * 12, np.full(12, SIGMA)))
    assert found.tip_covariance == pytest.approx(SIGMA**2 / 12 * np.eye(3), rel=1e-6, abs=1e-18)


def test_what_cannot_be_determined_is_said():
    rng = np.random.default_rng(5)
    about_z = np.array([matrix_of_euler(np.radians([0, 0, angle])) for angle in (0, 40, 80, 120)])
    level = Touches(about_z, -about_z @ TIP, ["pin"] * 4, np.full(4, np.nan))
    with pytest.raises(ValueError, match="do not all turn about one axis"):
        calibrate(level)
    few = {"primary": POINTS["primary"][:2], "secondary": POINTS["secondary"]}
    with pytest.raises(ValueError, match="3 points of face primary and 1 points of face tertiary"):
        calibrate(touched(rng, faces=few))
    line = POINTS | {"primary": [(0.1 * k, 0.05, 0) for k in range(1, 5)]}
    with pytest.raises(ValueError, match="lie on one line"):
        calibrate(touched(rng, noise=1e-9, faces=line))
    exchanged = {
        "primary": POINTS["primary"],
        "secondary": POINTS["tertiary"],
        "tertiary": POINTS["secondary"],
    }
    with pytest.raises(ValueError, match="may be exchanged"):
        calibrate(touched(rng, faces=exchanged))
    with pytest.raises(ValueError, match="tool_in_flange_mm"):
        calibrate(touched(rng, fixed=0))
