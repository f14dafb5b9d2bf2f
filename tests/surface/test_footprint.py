"""Sampling a cloud in discs: brute force, transmission, edges."""

import numpy as np
import pytest

from metro.surface.footprint import Window, of_the_face, sample, window

RADIUS = 1.5
DISC = Window(RADIUS, RADIUS)  # the clouds are in mm, and so is it


def lattice(size: float = 60.0, pitch: float = 0.3, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(0, size, pitch), np.arange(0, size, pitch))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    points[:, :2] += rng.uniform(-0.1, 0.1, (len(points), 2))
    return rng.permutation(points)


def test_discs_hold_the_points_that_a_search_of_all_finds() -> None:
    rng, cloud = np.random.default_rng(1), lattice(20.0, 0.5)
    cloud[:, 2] = rng.normal(size=len(cloud))
    x, y = rng.uniform(-2, 22, (2, 80))
    found = sample(cloud, x, y, DISC)
    for i in range(len(x)):
        inside = cloud[np.hypot(cloud[:, 0] - x[i], cloud[:, 1] - y[i]) <= RADIUS, 2]
        assert found.count[i] == len(inside)
        if len(inside) >= 5:
            assert found.height[i] == pytest.approx(inside.mean(), abs=1e-12)
        else:
            assert np.isnan(found.height[i])


def test_a_wave_of_twelve_millimetres_keeps_0_925_of_its_height() -> None:
    cloud = lattice()
    cloud[:, 2] = np.cos(2 * np.pi * (cloud[:, 0] - 24.0) / 12.0)
    found = sample(cloud, np.array([24.0, 36.0]), np.array([30.0, 30.0]), DISC)
    assert found.height == pytest.approx(0.925, abs=0.006)


def test_noise_about_a_tilted_surface_is_told_from_the_tilt() -> None:
    cloud = lattice()
    cloud[:, 2] = 0.5 * cloud[:, 0] - 0.2 * cloud[:, 1] + np.random.default_rng(2).normal(0, 0.02, len(cloud))
    x = np.linspace(5, 55, 200)
    found = sample(cloud, x, np.full(200, 30.0), DISC)
    assert np.sqrt(np.mean(found.sd**2)) == pytest.approx(0.02, rel=0.04)


def test_coverage_is_whole_inside_half_at_an_edge_and_nothing_outside() -> None:
    found = sample(lattice(), np.array([30.0, 59.9, 80.0]), np.full(3, 30.0), DISC)
    assert found.coverage[0] == 1.0
    assert 0.4 <= found.coverage[1] <= 0.65
    assert (found.coverage[2], found.count[2]) == (0.0, 0)


def test_a_disc_over_the_edge_of_a_block_reads_the_face_or_nothing() -> None:
    rng, mm = np.random.default_rng(4), 1e-3
    face = lattice(60.0, 0.5)
    wall = np.column_stack([rng.uniform(-0.2, 0.0, 4000), rng.uniform(0, 60, 4000), rng.uniform(-3, 0, 4000)])
    cloud = np.concatenate([face, wall]) * mm
    cloud[:, 2] += rng.normal(0, 0.02 * mm, len(cloud))
    along = np.array([-0.9, -0.3, 0.3, 0.9, *np.arange(3.0, 57.0, 3.0)])
    x, y = np.tile(along, 20) * mm, np.repeat(np.linspace(5, 55, 20), len(along)) * mm
    sampled = sample(cloud, x, y, Window())
    heights = of_the_face(sampled)
    assert np.nanmin(sampled.height) < -1.0 * mm
    assert np.nanmin(heights) > -0.05 * mm
    assert np.isfinite(heights[x >= 3.0 * mm]).all()


def test_a_steep_face_without_noise_is_read_whole() -> None:
    cloud = lattice() * 1e-3
    cloud[:, 2] = 0.02 * cloud[:, 0]
    x = np.linspace(5, 55, 50) * 1e-3
    sampled = sample(cloud, x, np.full(50, 0.03), Window())
    assert np.array_equal(of_the_face(sampled), sampled.height)


def test_an_elongated_disc_holds_what_a_search_in_its_own_axes_finds() -> None:
    rng, cloud = np.random.default_rng(5), lattice(20.0, 0.5)
    cloud[:, 2] = rng.normal(size=len(cloud))
    x, y = rng.uniform(2, 18, (2, 40))
    turn = 0.4
    found = sample(cloud, x, y, Window(2.5, 1.0, complex(np.cos(turn), np.sin(turn))))
    for i in range(len(x)):
        apart = cloud[:, :2] - [x[i], y[i]]
        along, across = apart @ [np.cos(turn), np.sin(turn)], apart @ [-np.sin(turn), np.cos(turn)]
        inside = cloud[np.hypot(along / 2.5, across / 1.0) <= 1.0, 2]
        assert found.count[i] == len(inside)
        assert found.height[i] == pytest.approx(inside.mean(), abs=1e-12)


def test_a_disc_holds_enough_points_of_a_coarse_cloud_and_is_no_wider_than_its_room() -> None:
    fine, coarse, narrow = (window(*given, 1j) for given in ((2e-4, 9.0), (1.3e-3, 9.0), (1.3e-3, 1.3e-3)))
    assert (fine.along, fine.across) == (1.5e-3, 1.5e-3)
    assert coarse.along == coarse.across
    assert np.pi * coarse.along * coarse.across / 1.3e-3**2 == pytest.approx(7.0)
    assert narrow.across == 1.3e-3
    assert narrow.along * narrow.across == pytest.approx(coarse.along * coarse.across)
    assert window(float("nan"), 9.0, 1.0).along == 1.5e-3
    assert window(5e-3, 1.2e-3, 1.0).along == 3e-3
