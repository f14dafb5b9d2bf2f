"""What load tests show beside elastic joints, told from scatter and from what is not linear in the force."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from metro.observables.arm.lack_of_fit import directions, lack_of_fit
from metro.observables.deformation.blocks import WallErrors

POSES, LOADS, JOINTS = 30, 24, 6
NOISE, SHARE = 10e-6, 0.05
PER_NEWTON = 2e-6  # size of each entry of a compliance matrix


def _tests(seed, *, share=SHARE, noise=NOISE, cubic=0.0):
    """Loads in several poses, in each of which the tip has another compliance than the joints make of it."""
    rng = np.random.default_rng(seed)
    poses, force, residual, moved = [], [], [], []
    for pose in range(POSES):
        pulls = rng.normal(0, 100, (LOADS, 3))
        compliance, beside = PER_NEWTON * rng.normal(size=(2, 3, 3))
        linear = pulls @ compliance.T
        rest = share * pulls @ beside.T + cubic * (pulls / 100) ** 3 + noise * rng.normal(size=pulls.shape)
        poses.append(np.arange(pose * LOADS, (pose + 1) * LOADS))
        force.append(pulls)
        residual.append(rest)
        moved.append(linear + rest)
    return poses, *(np.concatenate(each) for each in (force, residual, moved))


def test_another_compliance_in_each_pose_is_told_from_scatter():
    found = [lack_of_fit(*_tests(seed), unknowns=0) for seed in range(6)]
    assert np.mean([one.share for one in found]) == pytest.approx(SHARE, rel=0.05)
    assert np.mean([one.scatter for one in found]) == pytest.approx(NOISE, rel=0.02)


def test_scatter_alone_is_no_lack_of_fit():
    found = [lack_of_fit(*_tests(seed, share=0.0), unknowns=0) for seed in range(10)]
    size = PER_NEWTON * 100 * np.sqrt(3)
    assert np.median([one.share for one in found]) < 0.1 * NOISE / size
    assert max(one.share for one in found) < 0.2 * NOISE / size


def test_what_is_not_linear_in_the_force_is_scatter():
    plain, bent = (lack_of_fit(*_tests(1, share=0.0, cubic=c), unknowns=0) for c in (0.0, 50e-6))
    # The part of x³ that x does not hold has the variance 15 − 9 = 6.
    assert bent.scatter == pytest.approx(np.hypot(plain.scatter, 50e-6 * np.sqrt(6)), rel=0.15)


def test_too_few_loads_count_as_both():
    poses, force, residual, moved = _tests(2)
    poses = [pose[:3] for pose in poses]
    kept = np.concatenate(poses)
    poses = np.split(np.arange(len(kept)), len(poses))
    found = lack_of_fit(poses, force[kept], residual[kept], moved[kept], JOINTS)
    whole = np.sum(residual[kept] ** 2) / (residual[kept].size - JOINTS)
    assert found.scatter == pytest.approx(np.sqrt(whole))
    assert found.share == pytest.approx(np.sqrt(whole / np.mean(moved[kept] ** 2)))


def test_components_that_were_not_measured_are_left_out():
    poses, force, residual, moved = _tests(3)
    expected = lack_of_fit(poses, force, residual, moved, 0)
    residual[:, 2] = moved[:, 2] = np.nan
    found = lack_of_fit(poses, force, residual, moved, 0)
    assert found.scatter == pytest.approx(expected.scatter, rel=0.1)
    assert found.share == pytest.approx(expected.share, rel=0.2)


@given(scale=st.floats(1e-3, 1e3), seed=st.integers(0, 20))
def test_the_unit_of_the_force_does_not_matter(scale, seed):
    poses, force, residual, moved = _tests(seed)
    here = lack_of_fit(poses, force, residual, moved, JOINTS)
    there = lack_of_fit(poses, scale * force, residual, moved, JOINTS)
    assert there.share == pytest.approx(here.share, rel=1e-6)
    assert there.scatter == pytest.approx(here.scatter, rel=1e-6)


def test_directions_are_those_of_a_compliance_matrix():
    rng = np.random.default_rng(5)
    force, entries = rng.normal(size=(7, 3)), rng.normal(size=(3, 3))
    measured = rng.random((7, 3)) > 0.3
    made = directions(force, measured, 2.0) @ entries.ravel()
    assert made == pytest.approx(2.0 * (force @ entries.T)[measured])


def test_the_lack_of_fit_is_an_error_of_a_wall_beside_that_of_its_force():
    force = np.array([[0.0, 30.0, 40.0], [0.0, 0.0, 20.0]])  # 50 N at most
    newton, radian = (lambda _: np.full((2, 3), 1e-6)), (lambda _: np.full(2, 2.0))
    errors = WallErrors(newton, radian, lack_of_fit=0.04 * np.sqrt(3.0))
    made = errors.own(SimpleNamespace(force=force, kept=np.array([3, 9])), 0.03)
    assert made[:, :3] == pytest.approx(np.full((2, 3), 0.05 * 50.0 * 1e-6))


def test_gears_leave_a_level_and_waves_on_every_wall():
    """Independent of the force: an arcsecond at a reach of two metres is 9.7 µm."""
    setting = SimpleNamespace(force=np.full((40, 3), 1e-9), kept=np.arange(40))
    errors = WallErrors(lambda _: np.zeros((40, 3)), lambda _: np.full(40, 2.0), lack_of_fit=0.0)
    made = errors.own(setting)[:, 3:]
    assert made[:, 0] == pytest.approx(9.7e-6, rel=1e-3)
    assert np.sqrt((made[:, 1:] ** 2).sum(axis=1).mean()) == pytest.approx(4.85e-6, rel=1e-3)
    assert (np.abs(made[:, 1:]).max(axis=0)[:-1] > np.abs(made[:, 1:]).max(axis=0)[1:]).all()
