"""The chip as a function of the immersion, against the chip as a function of immersion and height."""

import math

import numpy as np
import pytest
from chip_grids import chip_slopes, chips_left

from metro.cutting.chip import Cut, chip_thickness
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.passes import passes

CUT = Cut(0.05e-3, 3e-3, Engagement(0.0, math.pi))
ANGLE = np.array([0.3, 1.0, 4.0])


@pytest.mark.parametrize("true_path", [False, True])
@pytest.mark.parametrize("angles", [evenly_pitched(3), (0.0, 1.4, 3.3, 4.9)])
@pytest.mark.parametrize("helix", [-30.0, 0.0, 45.0])
def test_at_one_angle_the_immersion_tells_the_chip_at_every_height(helix, angles, true_path):
    tool = Cutter(6e-3, math.radians(helix), angles, 8e-6, 0.7)
    before = passes(tool, CUT, true_path, ANGLE)
    for height in (0.0, 1e-3, 2.5e-3):
        phi = ANGLE[:, None] + np.array(angles) - tool.lag_per_depth * height
        expected = chip_thickness(tool, CUT, phi[:, None, :], np.array([height]), true_path)[:, 0]
        for angle, tooth in np.ndindex(phi.shape):
            rows = before.rows[angle, tooth % before.rows.shape[1]]
            least = chips_left(before.scale, rows, phi[angle, tooth : tooth + 1]).min()
            assert least == pytest.approx(expected[angle, tooth], abs=1e-15)


def test_angles_are_alike_without_runout_and_teeth_with_equal_pitch():
    def shape(angles, runout):
        return passes(Cutter(6e-3, 0.6, angles, runout, 0.7), CUT, False, ANGLE).rows.shape[:3]

    assert shape(evenly_pitched(3), 0.0) == (1, 1, 1)
    assert shape(evenly_pitched(3), 5e-6) == (3, 1, 3)
    assert shape((0.0, 1.4, 3.3), 5e-6) == (3, 3, 3)


@pytest.mark.parametrize("true_path", [False, True])
def test_the_slope_is_that_of_the_chip(true_path):
    before = passes(Cutter(6e-3, 0.6, evenly_pitched(3), 8e-6, 0.7), CUT, true_path, ANGLE)
    phi = np.array([-0.02, 0.5, 2.0, 3.1])
    for rows in before.rows.reshape(-1, *before.rows.shape[2:]):
        low, high = (chips_left(before.scale, rows, phi + d) for d in (-1e-5, 1e-5))
        found = chip_slopes(before.scale, rows, phi)
        assert found == pytest.approx((high - low) / 2e-5, abs=2e-4 * before.scale.feed * 6.3)
