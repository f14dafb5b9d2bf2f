"""Shift between two profiles: found to a fraction of a sample, with an honest error, not told from noise."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from metro.surface.shift import shift_between

SPACING = 0.2e-3
X = SPACING * np.arange(600)
KEPT = (X > 0.01) & (X < 0.11)
NONE = np.zeros((600, 0))


def wall(x, seed=1):
    rng = np.random.default_rng(seed)
    return sum(
        a * np.sin(2 * np.pi * x / length + phase)
        for a, length, phase in zip(
            rng.normal(size=9), rng.uniform(3e-3, 9e-3, 9), rng.uniform(0, 6.28, 9), strict=True
        )
    )


@pytest.mark.parametrize("shift", [-1.234e-3, -0.05e-3, 0.0, 0.333e-3, 1.7e-3])
def test_a_shift_is_found_to_a_fraction_of_a_sample(shift):
    found = shift_between(0.8 * wall(X - shift), wall(X), KEPT, SPACING, NONE)
    assert found.value == pytest.approx(shift, abs=0.002 * SPACING + 1e-6)


def test_the_error_is_that_of_repeats():
    rng = np.random.default_rng(2)
    found = [
        shift_between(
            wall(X - 0.3e-3) + 2.0 * gaussian_filter1d(rng.normal(size=600), 2.5),
            wall(X),
            KEPT,
            SPACING,
            NONE,
        )
        for _ in range(60)
    ]
    spread = np.std([one.value for one in found])
    assert spread == pytest.approx(np.mean([one.sd for one in found]), rel=0.35)


def test_profiles_that_are_not_alike_tell_no_shift():
    for seed in range(2, 12):
        found = shift_between(wall(X, seed), wall(X, seed + 50), KEPT, SPACING, NONE)
        assert not found.detected or found.alike > 0.6


def test_a_step_that_may_be_there_besides_is_not_taken_for_a_shift():
    bump = np.where(X > 0.05, (X - 0.05) / 3e-3 * np.exp(1 - (X - 0.05) / 3e-3), 0.0)
    step = np.tanh((X - 0.05) / 1e-3)
    profile = 3.0 * bump + wall(X) + 1.5 * step
    alone = shift_between(profile, 3.0 * bump + wall(X), KEPT, SPACING, NONE)
    besides = shift_between(profile, 3.0 * bump + wall(X), KEPT, SPACING, step[:, None])
    assert besides.value == pytest.approx(0.0, abs=1e-6)
    assert abs(alone.value) > 10 * abs(besides.value)
