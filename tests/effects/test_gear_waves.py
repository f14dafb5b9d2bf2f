"""Waves of the gears that walls share, against the covariance of random waves in closed form."""

import math

import elastic_arm
import numpy as np
import pytest

from metro.observables.deformation.blocks import with_waves
from metro.observables.deformation.gear_waves import (
    LEAST,
    LEFT,
    MOST,
    PER_TURN,
    Path,
    mean_square,
    principal_waves,
)
from metro.observables.deformation.model import DeformationModel
from metro.observables.deformation.setting import CutWall
from metro.units import ARCSEC

SHARP = (1e-3, 0.5e-3)  # a filter that lets everything pass
RATIO = np.array([120.0])


def path(start, turn, count=41):
    return start + np.linspace(0.0, turn, count)[:, None]


def kernel(q, other, at, other_at, orders):
    """Covariance (m, k) of sums of waves of random phase about their values where the work was touched."""

    def both(a, b):
        return np.cos(orders * (a[:, None, None] - b[None, :, None])).mean(axis=-1)

    one, two = np.array([at]), np.array([other_at])
    return both(q, other) - both(q, two) - both(one, other) + both(one, two)


def test_the_mean_square_is_that_of_a_sine_whose_size_is_drawn_evenly_by_its_logarithm():
    rng = np.random.default_rng(0)
    peak = 0.5 * np.exp(rng.uniform(math.log(2.0), math.log(30.0), 400_000)) * ARCSEC
    wave = peak * np.sin(rng.uniform(0.0, 2 * math.pi, len(peak)))
    assert mean_square() == pytest.approx(np.mean(wave**2), rel=0.02)
    assert (LEAST, MOST) == (2 * ARCSEC, 30 * ARCSEC)


def test_the_components_have_the_covariance_of_random_waves_up_to_what_is_left_out():
    angles = [path(0.2, 0.08), path(0.25, -0.05, 31), path(-0.6, 0.1)]
    lever = [1.7 + 0.1 * np.cos(angle) for angle in angles]
    every = [np.arange(len(angle)) for angle in angles]
    found = np.vstack(
        principal_waves([Path(*one, *SHARP) for one in zip(angles, lever, every, strict=True)], RATIO)
    )
    orders = np.concatenate([PER_TURN, np.outer(PER_TURN, RATIO).ravel()])
    middle = [float(angle[len(angle) // 2, 0]) for angle in angles]
    covariance = mean_square() * np.block(
        [
            [
                a * b.T * kernel(p[:, 0], q[:, 0], at, to, orders)
                for q, b, to in zip(angles, lever, middle, strict=True)
            ]
            for p, a, at in zip(angles, lever, middle, strict=True)
        ]
    )
    rest = covariance - found @ found.T
    assert np.trace(covariance) > 20 * len(found) * LEFT**2
    assert 0.0 < np.trace(rest) < len(found) * LEFT**2
    assert np.linalg.eigvalsh(rest)[0] > -1e-3 * LEFT**2


def test_walls_along_one_path_have_the_same_waves_and_one_back_along_it_the_same_the_other_way_round():
    angles = [path(0.2, 0.08), path(0.2, 0.08), path(0.28, -0.08)]
    lever = [np.full(angle.shape, 1.5) for angle in angles]
    found = principal_waves(
        [Path(*one, np.arange(41), 1e-3, 8e-3) for one in zip(angles, lever, strict=True)]
    )
    np.testing.assert_allclose(found[0], found[1], atol=1e-12)
    np.testing.assert_allclose(found[0], found[2][::-1], atol=1e-12)


@pytest.mark.parametrize("declared", [True, False])
def test_random_waves_lie_in_the_components_up_to_what_is_left_out_each_as_large_as_is_believed(declared):
    """The ratio of a gear is what is declared, or anything from 50 to 200."""
    rng = np.random.default_rng(7)
    angles = [path(rng.uniform(-1.0, 1.0), rng.uniform(-0.1, 0.1)) for _ in range(4)]
    lever = [np.full(angle.shape, 1.5) for angle in angles]
    ratios = RATIO if declared else None
    walls = [Path(*one, np.arange(41), *SHARP) for one in zip(angles, lever, strict=True)]
    found = np.vstack(principal_waves(walls, ratios))
    rests, amplitudes = [], []
    for _ in range(600):
        ratio = RATIO[0] if declared else rng.uniform(50.0, 200.0)
        orders = np.array([1.0, 2.0, ratio, 2.0 * ratio])
        waves = rng.normal(0.0, math.sqrt(mean_square() / 4), (2, 4))
        error = [(np.cos(q * orders) * waves[0] + np.sin(q * orders) * waves[1]).sum(axis=1) for q in angles]
        height = np.concatenate([1.5 * (one - one[20]) for one in error])
        amplitude = np.linalg.lstsq(found, height)[0]
        rests.append(np.mean((height - found @ amplitude) ** 2))
        amplitudes.append(amplitude)
    assert math.sqrt(np.mean(rests)) < 1.1 * LEFT
    np.testing.assert_allclose(np.mean(np.square(amplitudes), axis=0), 1.0, atol=0.3)


def test_the_model_adds_them_to_walls_and_to_no_load_test():
    task = elastic_arm.problem({}, 0)
    walls = [block for block in task.blocks if isinstance(block.setting, CutWall)]
    base, shared = with_waves(DeformationModel(elastic_arm.ARM), walls, None)
    assert base.waves > 2
    assert [one.name for one in base.believed] == [f"gear_wave_{k + 1}" for k in range(base.waves)]
    compliance = 1.0 / elastic_arm.STIFFNESS
    amplitude = np.random.default_rng(2).normal(size=base.waves)
    for before, after in zip(walls, shared, strict=True):
        matrix, offset = base.design(after, np.zeros(0))
        alone, without = DeformationModel(elastic_arm.ARM).design(before, np.zeros(0))
        np.testing.assert_array_equal(offset, without)
        gained = matrix @ np.concatenate([compliance, amplitude]) - alone @ compliance
        np.testing.assert_allclose(gained, after.setting.waves @ amplitude, atol=1e-15)
    test = task.role("calibrate")[0]
    assert not base.design(test, np.zeros(0))[0][:, 6:].any()
