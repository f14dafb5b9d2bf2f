"""The load on the flange from torques that the virtual cell's own arm, and a numerical Lagrangian, make."""

import numpy as np
import pytest
from scipy.stats import t as student

from metro.robot.kinematics import link_frames
from metro.robot.payload_identification import about_centre, identify_payload
from metro.robot.rigid_body import torque_regressor
from virtual_cell.arm import Arm
from virtual_cell.recipes.irb6640 import ARM

DH = ARM.dh * np.array([np.pi / 180, np.pi / 180, 1e-3, 1e-3])
MASS, CENTRE = 76.53, np.array([-0.00504, 0.00030, 0.22567])  # [F] table 4
INERTIA = np.array([1.2, 0.1, -0.05, 1.6, 0.02, 0.9])
LINKS = np.random.default_rng(1).uniform(5, 300, 60) * np.tile([1, *[0.2] * 3, *[0.05] * 6], 6)
NOISE = np.array([8.0, 8.0, 5.0, 2.0, 1.5, 1.0])


def poses(rng, count):
    return rng.uniform(-1.0, 1.0, (count, 6)) * [1.0, 0.4, 0.4, 2.5, 1.6, 2.5]


def holding(q, mass, centre):
    """Torques that hold a mass on the flange, by the potential energy's differences."""
    step, torque = 1e-6, np.zeros(6)

    def height(angles):
        flange = link_frames(DH, angles)[6]
        return (flange[:3, :3] @ centre + flange[:3, 3])[2]

    for joint in range(6):
        aside = step * np.eye(6)[joint]
        torque[joint] = mass * 9.81 * (height(q + aside) - height(q - aside)) / (2 * step)
    return torque


def at_rest(rng, count=30, noise=NOISE, offset=4.0):
    """Torques of the virtual arm with its own masses, with the load in every second pose."""
    arm = Arm(ARM.dh, ARM.tip, ARM.tool_axes, ARM.stiffness, np.array([400.0, 200, 250, 80, 40, 12]))
    q, loaded = poses(rng, count), np.arange(count) % 2 == 0
    torque = np.array([arm.gravity(one) for one in q]) + offset * np.array([1, -1, 1, -1, 1, -1])
    torque[loaded] += np.array([holding(one, MASS, CENTRE) for one in q[loaded]])
    return q, torque + noise * rng.normal(size=q.shape), loaded


def in_motion(rng, count=120, noise=NOISE):
    q, rate, rise = poses(rng, count), rng.uniform(-1.5, 1.5, (count, 6)), rng.uniform(-4, 4, (count, 6))
    loaded = np.arange(count) % 2 == 0
    c = CENTRE
    about = INERTIA + MASS * np.array(
        [
            c[1] ** 2 + c[2] ** 2,
            -c[0] * c[1],
            -c[0] * c[2],
            c[0] ** 2 + c[2] ** 2,
            -c[1] * c[2],
            c[0] ** 2 + c[1] ** 2,
        ]
    )
    regressor = torque_regressor(DH, q, rate, rise)
    torque = regressor @ LINKS + 3.0 * rate + 20.0 * np.sign(rate)
    torque += (regressor[..., -10:] @ np.array([MASS, *(MASS * c), *about])) * loaded[:, None]
    return q, torque + noise * rng.normal(size=q.shape), loaded, (rate, rise)


def test_without_noise_the_load_is_recovered_from_rest_and_from_motion():
    rng = np.random.default_rng(2)
    found = identify_payload(DH, *at_rest(rng, noise=np.zeros(6)))
    assert found.mass == pytest.approx(MASS, rel=1e-6)
    assert found.centre == pytest.approx(CENTRE, abs=1e-6)
    assert np.isnan(found.inertia).all()
    found = identify_payload(DH, *in_motion(rng, noise=np.zeros(6)))
    assert found.mass == pytest.approx(MASS, rel=1e-8)
    assert found.inertia == pytest.approx(INERTIA, abs=1e-7)


def test_intervals_hold_the_truth_as_often_as_they_say():
    """Were the quantities one, 95 of 100 repeats of 150 draws would hold 91.5 to 98.5 %."""
    rng, rest, motion = np.random.default_rng(4), [], []
    for _ in range(150):
        for held, found, truth in (
            (rest, identify_payload(DH, *at_rest(rng)), np.array([MASS, *CENTRE])),
            (motion, identify_payload(DH, *in_motion(rng)), np.array([MASS, *CENTRE, *INERTIA])),
        ):
            value = np.array([found.mass, *found.centre, *found.inertia])[: len(truth)]
            reach = student.ppf(0.975, found.dof) * np.sqrt(np.diag(found.covariance)[: len(truth)])
            held.append(np.abs(value - truth) < reach)
    assert np.mean(rest) == pytest.approx(0.95, abs=0.035)
    assert np.mean(motion) == pytest.approx(0.95, abs=0.035)


def test_poses_that_do_not_tell_the_load_are_refused():
    rng = np.random.default_rng(6)
    q, torque, loaded = at_rest(rng)
    with pytest.raises(ValueError, match="with and without it"):
        identify_payload(DH, q, torque, np.ones_like(loaded))
    same = np.repeat(q[:1], 30, axis=0)
    with pytest.raises(ValueError, match="tilt the flange"):
        identify_payload(DH, same, torque, loaded)


def test_a_point_mass_has_no_inertia_about_its_centre():
    c = np.array([0.1, -0.2, 0.3])
    origin = 5.0 * np.array(
        [
            c[1] ** 2 + c[2] ** 2,
            -c[0] * c[1],
            -c[0] * c[2],
            c[0] ** 2 + c[2] ** 2,
            -c[1] * c[2],
            c[0] ** 2 + c[1] ** 2,
        ]
    )
    found = about_centre(np.array([5.0, *(5.0 * c), *origin]))
    assert found == pytest.approx([5.0, *c, *np.zeros(6)], abs=1e-12)
