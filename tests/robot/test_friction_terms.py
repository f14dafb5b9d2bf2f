"""Friction beyond Coulomb and viscous, made by laws of other forms than those that are looked for."""

import numpy as np
import pytest
from free_arm import COULOMB, DH, NOISE, VISCOUS, bare

from metro.robot.drives import NOMINAL, drives_of_cell
from metro.robot.joint_dynamics import fit_joints, free_motion

TIME = np.arange(0, 60, 0.01)
Q, RATE, LINKS, PLAIN = bare(TIME)
NAMES = ("speed", "load", "time")


def fits(beyond, seed=0, joints=(1,), noise=1.0, warmth=None):
    rng = np.random.default_rng(seed)
    torque = LINKS + PLAIN + beyond + noise * NOISE * rng.normal(size=Q.shape)
    log = free_motion(TIME, np.round(Q / 1e-4) * 1e-4, torque)
    warm = None if warmth is None else free_motion(TIME, Q, np.tile(warmth[:, None], (1, 6))).torque
    return fit_joints(DH, log, np.isin(range(6), joints), warm)


def claimed(beyond, **how):
    return {term.name: term for term in fits(beyond, **how)[0].terms}


def test_coulomb_and_viscous_friction_are_found_within_their_intervals():
    found = fits(0.0 * Q, joints=range(6))
    for fit in found:
        for pair, true in ((fit.coulomb, COULOMB), (fit.viscous, VISCOUS)):
            assert abs(pair[0] - true[fit.joint]) < max(4 * pair[1], 0.03 * true[fit.joint])
    assert [fit.joint for fit in found] == list(range(6))


def test_plain_friction_makes_no_claims():
    """36 joints without anything beyond; a claim in one of a hundred is granted."""
    terms = [term for seed in range(6) for fit in fits(0 * Q, seed, range(6)) for term in fit.terms]
    assert len(terms) <= 2


def test_a_stribeck_curve_of_gauss_form_is_seen_as_one_that_falls():
    found = claimed(0.6 * COULOMB * np.exp(-((RATE / 0.08) ** 2)) * np.sign(RATE))
    assert found["speed"].value > 0
    assert found["speed"].held_out < 1.0


def test_viscous_friction_that_levels_off_is_seen_as_such():
    found = claimed(40.0 * np.tanh(RATE / 0.3))
    assert found["speed"].value < 0


def test_friction_that_grows_with_the_load_is_seen_with_its_size():
    found = claimed(0.06 * np.abs(LINKS) * np.sign(RATE), joints=(2,))
    assert abs(found["load"].value - 0.06) < 3 * found["load"].sd
    assert found["load"].sd < 0.02
    assert "time" not in found


def test_the_size_of_a_load_that_the_poses_do_not_determine_is_not_claimed():
    """The weight that joint 2 carries is confounded with its friction in this motion."""
    assert "load" not in claimed(0.06 * np.abs(LINKS) * np.sign(RATE), joints=(1,))


def test_friction_that_warms_up_by_an_exponential_is_seen_as_falling_with_time():
    found = claimed(0.5 * COULOMB * np.exp(-TIME / 20)[:, None] * np.sign(RATE))
    assert found["time"].value < 0


def test_grease_that_warms_is_told_by_temperature_where_that_was_logged():
    """Up and down again, so that no trend in time is like it."""
    warmth = 30.0 + 8.0 * np.sin(2 * np.pi * TIME / 45.0)
    beyond = -0.02 * VISCOUS * (warmth - 30.0)[:, None] * RATE
    found = claimed(beyond, warmth=warmth)["viscous_temperature"]
    assert abs(found.value + 0.02 * VISCOUS[1]) < 3 * found.sd
    assert found.sd < 0.005 * VISCOUS[1]
    level = claimed(-0.02 * COULOMB * (warmth - 30.0)[:, None] * np.sign(RATE), warmth=warmth)["temperature"]
    assert abs(level.value + 0.02 * COULOMB[1]) < 3 * level.sd
    assert "viscous_temperature" not in claimed(beyond)


def test_a_temperature_that_has_nothing_to_do_with_friction_is_not_claimed():
    warmth = 30.0 + 8.0 * np.sin(2 * np.pi * TIME / 45.0)
    assert not [term for fit in fits(0 * Q, joints=range(6), warmth=warmth) for term in fit.terms]


def test_viscous_friction_that_falls_as_the_log_goes_on_is_seen():
    found = claimed(-6.0 * (TIME / TIME[-1])[:, None] * RATE)["viscous_time"]
    assert abs(found.value + 6.0) < 3 * found.sd


def test_the_drives_of_a_cell():
    count = 3
    assert drives_of_cell({}, count).relative == pytest.approx(NOMINAL)
    assert np.isnan(drives_of_cell({}, count).constant).all()
    given = {"torque_per_ampere_nm_a": [0.1, 0.1, 0.05], "gear_ratio": [100, 100, -50]}
    found = drives_of_cell(
        {"drives": {**given, "uncertainty": 0.03, "uncertainty_by_joint": [0.04] * 3}}, count
    )
    assert found.constant == pytest.approx([10, 10, -2.5])
    assert found.relative == pytest.approx(0.05)
    assert found.covariance[0, 1] == pytest.approx(0.03**2)
    assert "as drives of the cell states" in found.source
