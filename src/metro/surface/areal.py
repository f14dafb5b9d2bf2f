"""The areal Gaussian filter (ISO 16610-61) on a grid of cell sums, and the rejection of single points.

Points are summed into square cells, and the filter runs over sums and counts alike: their quotient is the
weighted Gaussian regression of order zero over the points themselves, so empty cells and uneven density need
no special case. Only the sums are kept, so that a face needs no more memory the more points it has.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.surface.plane import Moments
from metro.units import Array

GAUSSIAN = (
    0.18739  # standard deviation of the weighting function over the nesting index: half transmission there
)
TRUNCATE = 4.5
MOST_REJECTED = 0.01
BORDER = 1e-6  # of a cell: far above the rounding of coordinates, far below what moves an index
FINEST = 6  # cells within a nesting index: more of them add nothing that passes the filter


@dataclass(frozen=True)
class Grid:
    """Square cells over a face: their size, the ``corner`` (2,) of the first, and rows and columns."""

    cell: float
    corner: Array
    shape: tuple[int, int]

    def cells(self, u: Array, v: Array) -> np.ndarray:
        """Return the number (n,) of the cell of each point in the flattened grid.

        A point on the border of two cells belongs to the upper one, and so does a point that rounding has
        put ``BORDER`` of a cell below it: whole rows of a lattice of points may lie on a border.
        """
        row, column = (
            np.floor((along - corner) * (1 / self.cell) + BORDER)
            for along, corner in zip((u, v), self.corner, strict=True)
        )
        row *= self.shape[1]
        row += column
        # one conversion, which is slow, instead of two
        number: np.ndarray = row.astype(np.intp)
        return number

    def sums(self, cells: np.ndarray, values: Array | None = None) -> Array:
        """Return the sum of ``values`` (n,) per cell, or the number of points, in the grid's shape."""
        size = self.shape[0] * self.shape[1]
        return np.bincount(cells, weights=values, minlength=size).astype(np.float64).reshape(self.shape)

    def centres(self) -> Array:
        """In-plane coordinates (cells, 2) of the cells' centres, in the order of the flattened grid."""
        number = np.indices(self.shape).reshape(2, -1).T
        return self.corner + (number + 0.5) * self.cell


@dataclass(frozen=True)
class CellSums:
    """Number of points and sum of their deviations in each cell of ``grid``, both in its shape."""

    grid: Grid
    count: Array
    total: Array

    def without(self, cells: np.ndarray, values: Array) -> CellSums:
        """Return the sums less those of the points with ``values`` (m,) in ``cells`` (m,)."""
        gone = self.grid.sums(cells), self.grid.sums(cells, values)
        return CellSums(self.grid, self.count - gone[0], self.total - gone[1])


def make_grid(low: Array, high: Array, cell: float) -> Grid:
    """Lay a grid over the in-plane rectangle from ``low`` to ``high`` (2,), seen from a point within it.

    That point, the centroid of a cloud, is the middle of a cell: seen from the other side or end of the face,
    the same points share a cell, and the filtered surface is the same.
    """
    before, after = (np.ceil(np.abs(end) / cell - 0.5 + BORDER).astype(int) for end in (low, high))
    rows, columns = (int(n) for n in before + after + 1)
    return Grid(cell, -(before + 0.5) * cell, (rows, columns))


def cell_size(spacing: float, nesting_index: float) -> float:
    """Size of a cell: two pitches, so that few are empty, but no finer than the filter needs."""
    return max(2 * spacing, nesting_index / FINEST)


def point_spacing(gathered: Moments) -> float:
    """Pitch of a square lattice with as many points on a rectangle of the same moments: 12 √(λ₁ λ₂)."""
    spread = np.linalg.eigvalsh(gathered.scatter)[1:] / gathered.count
    return float(np.sqrt(12 * np.sqrt(np.prod(np.maximum(spread, 0.0))) / gathered.count))


def gaussian_s_filter(sums: CellSums, nesting_index: float) -> Array:
    """Return the low-pass filtered surface on the grid's cells; NaN where no point is in reach.

    Parameters
    ----------
    sums : of deviations from a plane that takes out the tilt.
    nesting_index : wavelength of half transmission, in the unit of the coordinates; at least three cells.
    """
    from scipy.ndimage import gaussian_filter

    width = filter_width(sums.grid.cell, nesting_index)
    total = gaussian_filter(sums.total, width, mode="constant", truncate=TRUNCATE)
    weight = gaussian_filter(sums.count, width, mode="constant", truncate=TRUNCATE)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(weight > 1e-6, total / weight, np.nan)


def residual_share(sums: CellSums, nesting_index: float, correlation: float) -> float:
    """Return the share of the variance of noise that the residuals of points from the filtered surface hold.

    1 − 2 Σ wᵢ rᵢ₀ + Σ wᵢ wⱼ rᵢⱼ with the weights w of the filter for the points of a lattice, and noise
    correlated as r = exp(−d²/4c²), which white noise becomes when it is blurred; both are products of one
    factor along either axis.

    Parameters
    ----------
    correlation : standard deviation c of the blur, in the unit of the coordinates; 0 for white noise.
    """
    from scipy.ndimage import gaussian_filter1d

    side = max(1, round(float(np.sqrt(sums.count.sum() / np.count_nonzero(sums.count)))))
    reach = int(5 * nesting_index / sums.grid.cell)
    response = gaussian_filter1d(
        np.eye(1, 2 * reach + 1, reach)[0],
        filter_width(sums.grid.cell, nesting_index),
        mode="constant",
        truncate=TRUNCATE,
    )
    weight = np.repeat(response / side, side)
    apart = np.abs(np.subtract.outer(np.arange(len(weight)), np.arange(len(weight)))) * sums.grid.cell / side
    alike = np.exp(-((apart / correlation) ** 2) / 4) if correlation else np.eye(len(weight))
    pulled = (weight @ alike)[reach * side : (reach + 1) * side]  # of the points in the middle cell
    return float(1 - 2 * pulled.mean() ** 2 + (weight @ alike @ weight) ** 2)


def filter_width(cell: float, nesting_index: float) -> float:
    """Return the deviation, in cells, of the kernel with which half of a wave as long as the index passes.

    The kernel is sampled at the cells, and the mean over a cell has weakened the wave before. Where a cell is
    a third of the index, neither is a Gaussian any more, and variances that add up would pass 0.6 of it.

    Parameters
    ----------
    cell : at most a third of ``nesting_index``, in its unit.
    """
    from scipy.optimize import brentq

    wave = 2 * np.pi * cell / nesting_index  # per cell, rad
    wanted = 0.5 / np.sinc(wave / (2 * np.pi))
    widest = GAUSSIAN * nesting_index / cell + 1
    steps = np.arange(-np.ceil(TRUNCATE * widest), np.ceil(TRUNCATE * widest) + 1)

    def excess(width: float) -> float:
        kernel = np.exp(-0.5 * (steps / width) ** 2)
        return float(kernel @ np.cos(wave * steps) / kernel.sum()) - wanted

    width: float = brentq(excess, 0.2, widest)
    return width


def interior(sums: CellSums, margin: float) -> np.ndarray:
    """Mask of the cells at least ``margin`` inside the outline of the points (holes of one cell closed)."""
    from scipy.ndimage import maximum_filter, minimum_filter

    # With a cell more on every side, so that closing holes widens the outline alike wherever the grid ends.
    covered = maximum_filter(np.pad(sums.count > 0, 1), size=3)
    reach = 2 * (int(np.ceil(margin / sums.grid.cell)) + 1) + 1
    mask: np.ndarray = minimum_filter(covered, size=reach, mode="constant", cval=False)
    return mask[1:-1, 1:-1]


def crop_margin(spacing: float, nesting_index: float, least: float) -> float:
    """Width of the rim in which edges disturb: three pitches, ``least`` (1 mm), or half the nesting index."""
    return max(3 * spacing, least, nesting_index / 2)


@dataclass(frozen=True)
class Readings:
    """Some points of a face: their cell (m,) and deviation (m,)."""

    cells: np.ndarray
    deviations: Array


def local_outliers(
    sums: CellSums, sample: Readings, suspects: Readings, points: int, nesting_index: float
) -> tuple[np.ndarray, float, CellSums]:
    """Return which suspects (m,) are outliers, the local noise, and the sums without the outliers.

    A point is rejected when its residual from the filtered surface exceeds k robust standard deviations with
    ``2 n Φ(−k) = 0.05`` (at most one false rejection in twenty faces). The worst point of a cell goes first,
    since it pulls the filtered surface and makes its sound neighbours look wrong. Where more than one point
    in a hundred would go, they are not single points but a feature of the face, and none is rejected.

    Parameters
    ----------
    sample : points from which the noise is estimated. suspects : all points that may be rejected.
    points : number of all points.
    """
    from scipy.special import ndtri

    rejected = np.zeros(len(suspects.cells), dtype=bool)
    limit, kept = -float(ndtri(0.025 / points)), sums
    of_all = sigma = 0.0
    for number in range(20):
        smooth = gaussian_s_filter(kept, nesting_index).ravel()
        # where all points of a neighbourhood are rejected there is no surface to compare with
        sigma = 1.4826 * float(np.nanmedian(np.abs(sample.deviations - smooth[sample.cells])))
        of_all = of_all if number else sigma
        residual = np.where(rejected, 0.0, np.abs(suspects.deviations - smooth[suspects.cells]))
        over = np.flatnonzero(residual > limit * sigma)
        if not len(over) or not sigma:
            break
        worst_first = over[np.argsort(-residual[over])]
        rejected[worst_first[np.unique(suspects.cells[worst_first], return_index=True)[1]]] = True
        kept = sums.without(suspects.cells[rejected], suspects.deviations[rejected])
    if np.count_nonzero(rejected) > MOST_REJECTED * points:
        return np.zeros_like(rejected), of_all, sums
    return rejected, sigma, kept
