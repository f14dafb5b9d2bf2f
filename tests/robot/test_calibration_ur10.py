"""A UR10 under a laser tracker: two series, four months apart, of poses as others recorded them."""

import os
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from metro.robot.calibration.poses import Poses, approached
from metro.robot.calibration.study import calibrated, left_out

DATA = Path(os.environ.get("METRO_REAL_DATA", Path(__file__).parents[2] / "../shared/real")).parent
FOLDER = DATA / "field/robot-poses-ur10"
FILES = {"grid": "grid/measurements_grid.csv", "random": "random/measurements_random_poses.csv"}
# Published by the manufacturer: θ₀, α, d, a in rad and m
ROWS = np.array(
    [
        [0, np.pi / 2, 0.1273, 0],
        [0, 0, 0, -0.612],
        [0, 0, 0, -0.5723],
        [0, np.pi / 2, 0.163941, 0],
        [0, -np.pi / 2, 0.1157, 0],
        [0, 0, 0.0922, 0],
    ]
)
SECONDS = 60.0
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="the real data (METRO_REAL_DATA) are not there")


def series(name, count):
    table = pd.read_csv(FOLDER / FILES[name], sep=";", decimal=",")
    chosen = np.linspace(0, len(table) - 1, min(count, len(table))).astype(int)
    q = table.filter(like="_joint").to_numpy(float)
    at = table[[f"measurement_{axis}" for axis in "xyz"]].to_numpy(float) / 1e3
    warm = table["measurement_temperature"].to_numpy(float)
    whole = Poses(q, at, np.zeros(len(q)), np.arange(len(q), dtype=float), warm, approached(q))
    return whole.of(chosen)


@pytest.fixture(scope="module")
def found():
    """Return the calibration by either series."""
    return {name: calibrated(series(name, 1500), ROWS) for name in FILES}


def curve(fit, joint, degrees):
    (place,) = [k for k, e in enumerate(fit.effects) if (e.code, e.joint) == ("curve", joint)]
    q = np.zeros((len(degrees), 6))
    q[:, joint] = np.deg2rad(degrees)
    blank = np.zeros(len(q))
    basis = fit.effects[place].basis(Poses(q, q[:, :3], blank, blank, blank, q), fit.state)
    return basis @ fit.values[place]


@pytest.mark.parametrize("count", [500, pytest.param(5000, marks=pytest.mark.slow)])
def test_held_out_poses_of_the_random_series_are_predicted(count):
    for held in left_out(series("random", count), ROWS):
        nominal, geometry, effects = (1e3 * np.median(distances) for distances in held.distances)
        assert 0.8 < nominal < 1.2
        assert 0.38 < geometry < 0.46
        assert effects < (0.40 if held.kind == "random" else 0.55)
        assert effects < 0.12


@pytest.mark.slow
def test_five_thousand_poses_with_all_effects_are_fitted_within_a_minute():
    started = time.process_time()
    calibrated(series("grid", 5000), ROWS)
    assert time.process_time() - started < SECONDS


def test_what_was_left_is_the_curves_of_five_joints_readings(found):
    for one in found.values():
        assert {e.joint for e in one.final.effects if e.code == "curve"} == {0, 1, 2, 3, 4}
        assert one.final.scale < 6e-5
        assert one.fits[1].scale > 1.5e-4


@pytest.mark.parametrize(("joint", "low", "high"), [(2, 35, 115), (4, 5, 120)])
def test_a_curve_of_one_series_is_that_of_the_other(found, joint, low, high):
    """The series share neither poses nor the place of the robot, and were taken four months apart."""
    degrees = np.arange(low, high, 0.5)
    turn = np.deg2rad(degrees)
    geometry = np.column_stack([np.ones_like(turn), turn, np.sin(turn), np.cos(turn)])
    both = [curve(found[name].final, joint, degrees) for name in ("grid", "random")]
    first, second = (v - geometry @ np.linalg.lstsq(geometry, v, rcond=None)[0] for v in both)
    assert np.corrcoef(first, second)[0, 1] > 0.95
    assert 2e-4 < np.std(first) < 6e-4
