"""The areal filter and the rejection of points."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from metro.surface.areal import (
    CellSums,
    Grid,
    Readings,
    gaussian_s_filter,
    interior,
    local_outliers,
    make_grid,
    point_spacing,
    residual_share,
)
from metro.surface.plane import moments

NESTING = 2.5


def lattice(
    pitch: float = 0.375, size: tuple[float, float] = (120.0, 30.0), seed: int | None = None
) -> np.ndarray:
    x, y = np.meshgrid(*(np.arange(pitch / 2, extent, pitch) for extent in size), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel()])
    return (
        points
        if seed is None
        else points + np.random.default_rng(seed).uniform(-pitch, pitch, points.shape) / 2
    )


def summed(points: np.ndarray, values: np.ndarray, cell: float = 0.75) -> tuple[CellSums, np.ndarray]:
    """Sums per cell, and the cell of each point."""
    middle = points.mean(axis=0)
    grid = make_grid(points.min(axis=0) - middle, points.max(axis=0) - middle, cell)
    grid = replace(grid, corner=grid.corner + middle)
    cells = grid.cells(*points.T)
    return CellSums(grid, grid.sums(cells), grid.sums(cells, values)), cells


@pytest.mark.parametrize("factor", [1.0, 1.5, 2.0, 4.0])
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("cells", [3.0, 10 / 3, 4.5, 6.0])
def test_a_wave_passes_by_the_transmission_of_iso_16610(factor: float, axis: int, cells: float) -> None:
    points = lattice(NESTING / cells / 2, seed=3)  # two pitches a cell, the least, and not in step with them
    wave = np.cos(2 * np.pi * points[:, axis] / (factor * NESTING))
    sums, _ = summed(points, wave, NESTING / cells)
    smooth = gaussian_s_filter(sums, NESTING)
    inside = interior(sums, 2 * NESTING)
    kept = smooth[inside] @ (
        reference := np.cos(2 * np.pi * sums.grid.centres()[inside.ravel()][:, axis] / (factor * NESTING))
    )
    kept /= reference @ reference
    assert kept == pytest.approx(np.exp(-np.pi * (0.46972 / factor) ** 2), abs=0.02)


def test_a_constant_passes_unchanged_through_uneven_density() -> None:
    points = lattice(seed=1)[np.random.default_rng(2).random(25600) < 0.5]
    smooth = gaussian_s_filter(summed(points, np.full(len(points), 7.0))[0], NESTING)
    np.testing.assert_allclose(smooth, 7.0, rtol=1e-12)


def test_noise_is_averaged_as_the_weights_say() -> None:
    points = lattice(seed=3)
    noise = np.random.default_rng(4).normal(size=len(points))
    sums, cells = summed(points, noise)
    rest = noise - gaussian_s_filter(sums, NESTING).ravel()[cells]
    assert rest.var() == pytest.approx(residual_share(sums, NESTING, 0.0), rel=0.02)


def test_of_blurred_noise_the_residuals_hold_what_the_filter_stops() -> None:
    points, blur = lattice(), 1.0
    rng = np.random.default_rng(8)
    shape = len(np.unique(points[:, 0])), len(np.unique(points[:, 1]))
    noise = gaussian_filter(rng.normal(size=shape), blur / 0.375, mode="wrap").ravel()
    sums, cells = summed(points, noise)
    fine = summed(points, noise, 0.375)[0]
    for nesting in (NESTING, 2 * NESTING):
        share = np.var(noise - gaussian_s_filter(sums, nesting).ravel()[cells]) / noise.var()
        assert residual_share(sums, nesting, blur) == pytest.approx(share, abs=0.025)
        # ∫ S (1 − H)² / ∫ S with S = exp(−a k²), H = exp(−b k²)
        a, b = (2 * np.pi * blur) ** 2, 2 * (np.pi * 0.18739 * nesting) ** 2
        continuous = 1 - 2 * a / (a + b) + a / (a + 2 * b)
        assert residual_share(fine, nesting, blur) == pytest.approx(continuous, abs=0.005)


def test_the_interior_keeps_the_margin_from_every_edge_and_closes_single_holes() -> None:
    points = lattice()
    hole = np.hypot(points[:, 0] - 60, points[:, 1] - 15) < 0.3
    sums, _ = summed(points[~hole], np.zeros(np.count_nonzero(~hole)), 0.5)
    centres = sums.grid.centres()[interior(sums, 2.0).ravel()]
    low, high = centres.min(axis=0), centres.max(axis=0)
    assert (low >= 2.0).all()
    assert (low <= 4.0).all()
    assert (np.array([120.0, 30.0]) - high >= 2.0).all()
    assert np.hypot(*(centres - [60, 15]).T).min() < 0.5


def test_spacing_of_a_lattice_is_its_pitch() -> None:
    flat = np.column_stack([lattice(0.5), np.zeros(len(lattice(0.5)))])
    assert point_spacing(moments(flat)) == pytest.approx(0.5, rel=1e-3)


def test_a_single_spike_is_rejected_alone_and_sound_points_are_kept() -> None:
    points = lattice(seed=5)
    values = np.random.default_rng(6).normal(0.0, 0.019, len(points)) + 0.1 * np.sin(points[:, 0] / 30)
    values[[77, 4000]] += [0.5, -0.3]
    sums, cells = summed(points, values)
    everything = Readings(cells, values)
    rejected, sigma, kept = local_outliers(sums, everything, everything, len(values), NESTING)
    assert set(np.flatnonzero(rejected)) == {77, 4000}
    assert kept.count.sum() == len(values) - 2
    assert sigma == pytest.approx(0.0175, rel=0.05)


def test_rounding_moves_no_point_across_a_border_of_cells() -> None:
    grid = Grid(0.5, np.zeros(2), (4, 4))
    along = np.array([1.0 - 1e-13, 1.0, 1.0 + 1e-13])
    assert grid.cells(along, np.zeros(3)).tolist() == [8, 8, 8]
    assert grid.cells(np.zeros(3), along).tolist() == [2, 2, 2]
