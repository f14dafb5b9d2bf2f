"""The clock of a robot log against that of the dynamometer, on torques made from a force by the test."""

from types import SimpleNamespace

import numpy as np
import pytest

from metro.observables.arm.clock import clock
from metro.observables.joint_force.model import TorqueRun, in_waves, running
from metro.robot.kinematics import Arm, jacobian

DH = np.array(
    [[0, 90, 500, 250], [90, 0, 0, 610], [-180, -90, 0, 70], [0, 90, 710, 0], [0, -90, 0, 0], [0, 0, 215, 0]]
) * (np.pi / 180, np.pi / 180, 1e-3, 1e-3)
ARM = Arm(DH, np.zeros(3), np.eye(4))
Q = np.radians([-20.3, -13.9, -4.4, -61.7, 34.9, 56.7])
BINS, WIDTH, NOISE = 140, 0.084, 1.6


def force(t):
    """Rise within 0.4 s, a steady cut, fall within 0.3 s: N."""
    shape = np.clip((t - 1.5) / 0.4, 0, 1) * np.clip((10.2 - t) / 0.3, 0, 1)
    return shape[:, None] * np.array([60.0, -110.0, 30.0])


def block(offset, drift, rng):
    """Torques by −Jᵀ f, stamped by a clock that is late and drifts, with friction that differs a little."""
    fine = np.arange(0.0, 12.0, 0.005)
    t = WIDTH * (np.arange(BINS) + 0.5)
    q = np.tile(Q, (BINS, 1))
    idle = np.zeros((BINS, 6))
    run = TorqueRun(q, np.ones((BINS, 6)), t, t, np.full(BINS, WIDTH), running(fine, force(fine)), idle)
    inner = (np.arange(20) + 0.5) / 20 - 0.5
    true = t - offset - drift * (t - t.mean())
    mean = np.mean([force(true + WIDTH * part) for part in inner], axis=0)
    torque = -mean @ jacobian(DH, Q)[:3] + NOISE * rng.normal(size=(BINS, 6)) + rng.normal(size=6)
    zeros = np.stack([in_waves(np.tile(joint, (BINS, 1))) for joint in np.eye(6)], axis=1)
    return SimpleNamespace(
        setting=run, measured=in_waves(torque), sigma=np.full(6 * BINS, NOISE), zeros=zeros
    )


@pytest.mark.parametrize(("offset", "drift"), [(0.0, 0.0), (0.217, 2e-3), (-0.5, -4e-3)])
def test_offset_and_drift_are_found_within_their_errors(offset, drift):
    rng = np.random.default_rng(3)
    found = [clock(block(offset, drift, rng), ARM, 1.0) for _ in range(12)]
    standard = np.array([[(c.offset - offset) / c.offset_sd, (c.drift - drift) / c.drift_sd] for c in found])
    assert np.abs(standard).max() < 4.0
    assert 0.5 < np.sqrt(np.mean(standard**2)) < 1.5
    assert np.mean([c.offset for c in found]) == pytest.approx(offset, abs=0.001)
    assert max(c.offset_sd for c in found) < 0.002


def test_noise_beyond_the_stated_widens_the_errors():
    """Torques that scatter three times as much as they are said to: so do the errors told."""
    rng = np.random.default_rng(5)
    one = block(0.1, 0.0, rng)
    honest = clock(one, ARM, 1.0)
    one.sigma = one.sigma / 3.0
    bold = clock(one, ARM, 1.0)
    assert bold.offset == pytest.approx(honest.offset, abs=1e-6)
    assert (bold.offset_sd, bold.drift_sd) == pytest.approx((honest.offset_sd, honest.drift_sd), rel=0.05)
    one.sigma = one.sigma * 9.0
    assert clock(one, ARM, 1.0).offset_sd == pytest.approx(3.0 * honest.offset_sd, rel=0.05)
