"""The slope of a short series against the scatter of many simulated ones."""

import numpy as np
import pytest

from metro.signals.slope import slope


@pytest.mark.parametrize("alike", [0.0, 0.5])
def test_the_deviation_is_the_scatter_of_many_series(alike):
    rng = np.random.default_rng(4)
    time, count = 0.075 * np.arange(60), 4000
    noise = rng.standard_normal((60, count))
    for row in range(1, 60):
        noise[row] = alike * noise[row - 1] + np.sqrt(1 - alike**2) * noise[row]
    rate, sd = slope(time, 3.0 * time[:, None] + noise)
    assert rate.mean() == pytest.approx(3.0, abs=4 * rate.std() / np.sqrt(count))
    assert np.sqrt(np.mean(sd**2)) == pytest.approx(rate.std(), rel=0.15)


def test_fewer_than_six_values_have_no_slope():
    rate, sd = slope(np.arange(5.0), np.ones((5, 3)))
    assert np.isnan(rate).all()
    assert np.isnan(sd).all()
