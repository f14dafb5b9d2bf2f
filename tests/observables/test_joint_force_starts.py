"""A path without its start from rest, and torques that follow the force late."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from metro.observables.joint_force.model import JointForceModel, TorqueRun, running
from metro.observables.joint_force.tables import _covered, _settled
from metro.robot.kinematics import arm_of_cell
from metro.signals.align import Aligned
from metro.signals.waves import waves

DH = [[0, 90, 500, 250], [90, 0, 0, 610], [-180, -90, 0, 70], [0, 90, 710, 0], [0, -90, 0, 0], [0, 0, 215, 0]]


@pytest.mark.parametrize(("first", "left_out"), [(-0.030, 5), (-0.006, 2), (0.002, 0)])
def test_the_start_of_a_path_is_left_out_but_for_most_of_the_air(first, left_out):
    x = first + 1e-3 * np.arange(60)
    pair = Aligned(np.arange(60.0), np.column_stack([x, x]), np.column_stack([x, x]))
    kept = _settled(pair, x)
    assert len(kept.s) == len(kept.first) == len(kept.second) == 60 - left_out
    assert kept.s[0] == left_out


def test_a_lag_of_the_drives_is_a_clock_that_is_late_by_as_much():
    model = JointForceModel(arm_of_cell({"arm": {"dh": DH}}, {}))
    t = np.linspace(0.0, 4.0, 81)
    force = np.column_stack([np.sin(3 * t), np.cos(2 * t), t]) * 50.0
    still = np.tile([0.1, -0.4, 0.2, 0.3, 0.8, 0.2], (81, 1))
    run = TorqueRun(still, np.zeros_like(still), t, t, np.full(81, 0.05), running(t, force), still)
    block = SimpleNamespace(setting=run)
    names = [one.name for one in model.parameters]
    beta = np.where(np.array(names) == "torque_gain", 1.0, 0.0)
    late = beta + np.where(np.array(names) == "drive_lag", 0.012, 0.0)
    matrix, offset = model.design(block, np.zeros(0), late)
    other, none = JointForceModel(model.arm, offset=0.012).design(block, np.zeros(0), beta)
    np.testing.assert_allclose(matrix @ late + offset, other @ beta + none, atol=1e-9)
    without, zero = model.design(block, np.zeros(0), beta)
    assert np.abs(matrix @ late + offset - without @ beta - zero).max() > 0.1


@pytest.mark.parametrize("lag", [0.0, 0.0694, -0.0131])
def test_a_clock_and_a_lag_change_the_torques_alike_however_late_they_are(lag):
    """A force with the ripple of the teeth, which no derivative over 5 ms is about."""
    arm = arm_of_cell({"arm": {"dh": DH}}, {})
    t, fine = np.linspace(0.0, 4.0, 81), np.linspace(0.0, 4.0, 8001)
    ripple = 30.0 * np.sin(2 * np.pi * 180.0 * fine)
    record = running(fine, np.column_stack([50 * np.sin(3 * fine) + ripple, ripple, fine]))
    still = np.tile([0.1, -0.4, 0.2, 0.3, 0.8, 0.2], (81, 1))
    run = TorqueRun(still, np.zeros_like(still), t, t, np.full(81, 0.05), record, still)
    block = SimpleNamespace(setting=run)
    names = np.array([one.name for one in JointForceModel(arm).parameters])
    beta = np.where(names == "torque_gain", 1.0, 0.0) + np.where(names == "drive_lag", lag, 0.0)
    clock, step = JointForceModel(arm, offset=0.0447), 1e-5
    own = clock.design(block, np.zeros(0), beta)[0][:, names == "drive_lag"][:, 0]
    moved, _ = clock.differences([replace(clock, offset=0.0447 + step)], block, np.zeros((1, 0)), beta)
    np.testing.assert_allclose(moved[0] / step, own, atol=1e-6 * np.abs(own).max())
    for less in (0.0447, 0.02, -0.1):
        other = replace(clock, offset=clock.offset - less)
        later = np.where(names == "drive_lag", beta + less, beta)
        expected, reached = (
            model.predictions(block, np.zeros((1, 0)), given)[0]
            for model, given in ((clock, beta), (other, later))
        )
        np.testing.assert_allclose(reached, expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize(("ends", "kept"), [((True, True), 60), ((True, False), 50), ((False, False), 39)])
def test_a_record_that_ends_in_the_cut_says_nothing_of_the_force_beyond(ends, kept):
    """Bins of 0.1 s from 1 s before a record of 4.05 s; with air at an end the force beyond is none."""
    time = -1.0 + 0.1 * np.arange(60)
    at = 0.005 * np.arange(811)
    known = (ends[0] | (at >= 0.05)) & (ends[1] | (at <= 4.0 - 0.05))
    pair = Aligned(np.arange(60.0), time[:, None], time[:, None])
    found = _covered(pair, time, pd.DataFrame({"t_s": at, "known": known}))
    assert len(found.s) == kept
    if not ends[1]:
        assert found.first.max() <= 3.95 < found.first.max() + 0.1
    if not ends[0]:
        assert found.first.min() >= 0.05 > found.first.min() - 0.1


def test_what_spreads_the_force_in_time_is_half_of_its_variance_times_the_curvature():
    """A filter of the drives that averages over 40 ms, against one that does not, both made in the test."""
    model = JointForceModel(arm_of_cell({"arm": {"dh": DH}}, {}))
    t, fine = np.linspace(0.0, 4.0, 81), np.linspace(0.0, 4.0, 4001)
    still = np.tile([0.1, -0.4, 0.2, 0.3, 0.8, 0.2], (81, 1))

    def force(at):
        return np.column_stack([np.sin(6 * at), np.cos(5 * at), np.sin(4 * at)]) * 50.0

    spread_over = 0.04 * (np.arange(41) - 20.0) / 41.0
    filtered = np.mean([force(fine + one) for one in spread_over], axis=0)
    sharp, soft = (
        SimpleNamespace(
            setting=TorqueRun(still, 0.0 * still, t, t, np.full(81, 0.05), running(fine, record), still)
        )
        for record in (force(fine), filtered)
    )
    names = [one.name for one in model.parameters]
    beta = np.where(np.array(names) == "torque_gain", 1.0, 0.0)
    spread = np.where(np.array(names) == "drive_smoothing", 0.5 * np.var(spread_over), 0.0)
    matrix, _ = model.design(sharp, np.zeros(0), beta)
    other, _ = model.design(soft, np.zeros(0), beta)
    inside = np.tile((t > 0.2) & (t < 3.8), 6)
    back = waves(np.eye(81)).T

    def along(waves_of_joints):
        return (back @ waves_of_joints.reshape(6, -1).T).T.ravel()[inside]

    changed, expected = along(matrix @ spread), along(other @ beta - matrix @ beta)
    assert np.abs(expected).max() > 0.01
    np.testing.assert_allclose(changed, expected, atol=0.05 * np.abs(expected).max())
