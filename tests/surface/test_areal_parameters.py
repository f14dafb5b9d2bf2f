"""Areal parameters of rasters: closed forms of waves, planes and random surfaces."""

import numpy as np
import pytest

from metro.surface.areal_parameters import Raster, areal_parameters, raster_of, scale_limited

STEP = 2e-6


def grid(rows=400, columns=500):
    return np.meshgrid(np.arange(columns) * STEP, np.arange(rows) * STEP)


def test_an_egg_box_has_its_closed_form_parameters():
    x, y = grid()
    z = 1e-6 * np.sin(2 * np.pi * x / 100e-6) * np.sin(2 * np.pi * y / 100e-6)
    found = areal_parameters(z, (STEP, STEP))
    # the mean of |sin| at 50 points to a wave is (2/50) cot(π/50), which goes to 2/π with more of them
    assert found["a"] == pytest.approx(1e-6 * (0.04 / np.tan(np.pi / 50)) ** 2, rel=1e-6)
    assert found["q"] == pytest.approx(0.5e-6, rel=1e-3)
    assert found["ku"] == pytest.approx(2.25, rel=2e-3)
    assert (found["sk"], found["p"], found["v"]) == pytest.approx((0.0, 1e-6, 1e-6), abs=1e-8)
    slope = 2 * np.pi * 1e-6 / 100e-6
    assert found["dq"] == pytest.approx(slope / np.sqrt(2), rel=5e-3)
    assert found["dr"] == pytest.approx(slope**2 / 4, rel=2e-2)  # (1 + s²)^½ − 1 of small slopes


def test_a_turned_surface_has_the_texture_aspect_ratio_of_its_making():
    random = np.random.default_rng(3)
    from scipy.ndimage import gaussian_filter

    # white noise through a Gaussian of s has the autocorrelation exp(−d²/4s²), 0.2 at 2 s (ln 5)^½
    z = gaussian_filter(random.standard_normal((800, 800)), (3, 12), mode="wrap")
    found = areal_parameters(z, (STEP, STEP))
    assert found["al"] == pytest.approx(2 * 3 * STEP * np.sqrt(np.log(5)), rel=0.05)
    assert found["tr"] == pytest.approx(0.25, abs=0.04)


def test_parallel_ridges_have_no_longest_way():
    x, _ = grid()
    found = areal_parameters(np.sin(2 * np.pi * x / 60e-6), (STEP, STEP))
    assert np.isnan(found["tr"])
    quarter = np.arccos(0.2) / (2 * np.pi) * 60e-6
    assert found["al"] == pytest.approx(quarter, rel=0.02)


def test_the_filter_passes_half_of_a_wave_as_long_as_its_index_and_the_plane_goes():
    x, y = grid()
    z = 1e-6 * np.cos(2 * np.pi * x / 50e-6) + 0.02 * x - 0.01 * y
    passed = scale_limited(Raster(z, (STEP, STEP)), 50e-6)
    whole = passed[:, : 18 * 25]  # of waves
    assert areal_parameters(whole, (STEP, STEP))["q"] == pytest.approx(0.5e-6 / np.sqrt(2), rel=5e-3)


def test_points_on_a_raster_are_found_in_any_order_with_points_missing():
    x, y = grid(40, 50)
    points = np.column_stack([x.ravel() + 0.3, y.ravel() - 0.1, np.arange(x.size)])
    points = np.random.default_rng(0).permutation(points)[:-100]
    found = raster_of(points)
    assert found is not None
    assert found.z.shape == (40, 50)
    assert found.spacing == pytest.approx((STEP, STEP))
    assert np.isnan(found.z).sum() == 100


def test_scattered_points_are_no_raster():
    assert raster_of(np.random.default_rng(0).uniform(size=(2000, 3))) is None


def test_a_surface_of_one_height_is_refused():
    with pytest.raises(ValueError, match="expected 64 or more that differ"):
        areal_parameters(np.ones((20, 20)), (1.0, 1.0))
