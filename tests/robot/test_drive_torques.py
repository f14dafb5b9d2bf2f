"""Torques of friction, each part alone against its formula."""

import numpy as np
import pytest

from metro.robot.drive_torques import TURNING, DriveTorques

Q, RATE, T = np.zeros((3, 6)), np.array([[0.2], [-0.1], [0.3]]) * np.ones(6), np.array([0.0, 1.0, 4.0])


@pytest.mark.parametrize("part", ["reversal", "warmup", "viscous"])
def test_each_part_of_friction_is_there_alone(part):
    side = np.tanh(RATE[:, 2] / TURNING)
    expected = {"reversal": 3.0 * side, "warmup": 3.0 * T * side, "viscous": 3.0 * RATE[:, 2]}[part]
    torque = DriveTorques().with_friction(2, **{part: 3.0}).at(Q, RATE, T)
    assert torque[:, 2] == pytest.approx(expected)
    assert not np.delete(torque, 2, axis=1).any()
