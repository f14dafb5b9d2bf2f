"""The noise of touched points, which are too few for a filter: by the same points touched again."""

import numpy as np
import pytest

from metro.surface.face_noise import repeat_noise
from metro.units import MM, UM

X, Y = (c.ravel() for c in np.meshgrid(np.arange(12) * 10 * MM, np.arange(8) * 10 * MM))
SIGMA = 5 * UM


@pytest.mark.parametrize(("times", "source"), [(2, "two scans of the face"), (4, "4 scans of the face")])
def test_the_noise_of_points_touched_again_is_as_uncertain_as_it_says(times, source):
    rng = np.random.default_rng(1)
    shape = np.column_stack([X, Y, 40 * UM * np.cos(30 * X)])
    found = []
    for _ in range(1000):
        scans = [shape + np.outer(rng.normal(0.0, SIGMA, X.size), [0, 0, 1]) for _ in range(times)]
        found.append(repeat_noise(scans, 2.5 * MM))
    sigma = np.array([each.sigma for each in found])
    assert sigma.mean() == pytest.approx(SIGMA, rel=0.02)
    assert found[0].relative == pytest.approx(sigma.std() / SIGMA, rel=0.08)
    assert found[0].source == source
    assert found[0].repeated
