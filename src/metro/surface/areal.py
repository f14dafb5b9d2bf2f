"""The areal Gaussian filter (ISO 16610-61) on a grid of cell sums, and the rejection of single points.

Points are summed into square cells, and the filter runs over sums and counts alike: their quotient is the
weighted Gaussian regression of order zero over the points themselves, so empty cells and uneven density need
no special case.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array

GAUSSIAN = (
    0.18739  # standard deviation of the weighting function over the nesting index: half transmission there
)
TRUNCATE = 4.5
MOST_REJECTED = 0.01


@dataclass(frozen=True)
class Grid:
    """Square cells over a face: their size, the ``corner`` (2,) of the first, and each point's cell (n,)."""

    cell: float
    corner: Array
    shape: tuple[int, int]
    cells: np.ndarray

    def sums(self, values: Array | None = None) -> Array:
        """Return the sum of ``values`` (n,) per cell, or the number of points, in the grid's shape."""
        size = self.shape[0] * self.shape[1]
        return np.bincount(self.cells, weights=values, minlength=size).astype(np.float64).reshape(self.shape)

    def centres(self) -> Array:
        """In-plane coordinates (cells, 2) of the cells' centres, in the order of the flattened grid."""
        number = np.indices(self.shape).reshape(2, -1).T
        return self.corner + (number + 0.5) * self.cell


def make_grid(coordinates: Array, cell: float) -> Grid:
    """Lay a grid over in-plane ``coordinates`` (n, 2)."""
    corner = coordinates.min(axis=0)
    number = ((coordinates - corner) / cell).astype(np.intp)
    rows, columns = (int(n) + 1 for n in number.max(axis=0))
    return Grid(cell, corner, (rows, columns), number[:, 0] * columns + number[:, 1])


def point_spacing(coordinates: Array) -> float:
    """Pitch of a square lattice that has as many points over the bounding rectangle."""
    return float(np.sqrt(np.prod(np.ptp(coordinates, axis=0)) / len(coordinates)))


def gaussian_s_filter(grid: Grid, values: Array, nesting_index: float) -> Array:
    """Return the low-pass filtered surface on the grid's cells; NaN where no point is in reach.

    Parameters
    ----------
    values : (n,) deviations of the points from a plane that takes out the tilt.
    nesting_index : wavelength of half transmission, in the unit of the coordinates; at least three cells.
    """
    from scipy.ndimage import gaussian_filter

    width = _width(grid, nesting_index)
    total = gaussian_filter(grid.sums(values), width, mode="constant", truncate=TRUNCATE)
    weight = gaussian_filter(grid.sums(), width, mode="constant", truncate=TRUNCATE)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(weight > 1e-6, total / weight, np.nan)


def point_weights(grid: Grid, nesting_index: float) -> tuple[float, float]:
    """Return the weight of a point in the filtered value of its cell, and the sum of squares of all weights.

    With independent noise of variance v, a filtered value has the variance ``v × squares``, and the rest of a
    point from it ``v × (1 − 2 own + squares)``.
    """
    from scipy.ndimage import gaussian_filter1d

    impulse = np.zeros(2 * int(5 * nesting_index / grid.cell) + 1)
    impulse[len(impulse) // 2] = 1.0
    response = gaussian_filter1d(impulse, _width(grid, nesting_index), mode="constant", truncate=TRUNCATE)
    counts = grid.sums()
    per_cell = float(counts.sum() / np.count_nonzero(counts))
    return float(response.max() ** 2 / per_cell), float((response @ response) ** 2 / per_cell)


def _width(grid: Grid, nesting_index: float) -> float:
    """Deviation of the weighting function in cells; averaging over a cell has a variance of 1/12 itself."""
    return float(np.sqrt((GAUSSIAN * nesting_index / grid.cell) ** 2 - 1 / 12))


def interior(grid: Grid, margin: float) -> np.ndarray:
    """Mask of the cells at least ``margin`` inside the outline of the points (holes of one cell closed)."""
    from scipy.ndimage import maximum_filter, minimum_filter

    covered = maximum_filter(grid.sums() > 0, size=3)
    reach = 2 * (int(np.ceil(margin / grid.cell)) + 1) + 1
    mask: np.ndarray = minimum_filter(covered, size=reach, mode="constant", cval=False)
    return mask


def crop_margin(spacing: float, nesting_index: float, least: float) -> float:
    """Width of the rim in which edges disturb: three pitches, ``least`` (1 mm), or half the nesting index."""
    return max(3 * spacing, least, nesting_index / 2)


def local_outliers(grid: Grid, values: Array, nesting_index: float) -> tuple[np.ndarray, float]:
    """Return a mask (n,) of points that stand out of their surroundings, and the local noise of the others.

    A point is rejected when its residual from the filtered surface exceeds k robust standard deviations with
    ``2 n Φ(−k) = 0.05`` (at most one false rejection in twenty faces). The worst point of a cell goes first,
    since it pulls the filtered surface and makes its sound neighbours look wrong. Where more than one point
    in a hundred would go, they are not single points but a feature of the face, and none is rejected.
    """
    from scipy.special import ndtri

    rejected = np.zeros(len(values), dtype=bool)
    limit = -float(ndtri(0.025 / len(values)))
    sigma = 0.0
    for _ in range(20):
        kept = Grid(grid.cell, grid.corner, grid.shape, grid.cells[~rejected])
        smooth = gaussian_s_filter(kept, values[~rejected], nesting_index).ravel()
        residual = np.where(rejected, 0.0, np.abs(values - smooth[grid.cells]))
        sigma = 1.4826 * float(np.median(residual))
        suspects = np.flatnonzero(residual > limit * sigma)
        if not len(suspects) or not sigma:
            break
        worst_last = suspects[np.argsort(residual[suspects])]
        rejected[
            list(dict(zip(grid.cells[worst_last].tolist(), worst_last.tolist(), strict=True)).values())
        ] = True
    if rejected.mean() > MOST_REJECTED:
        rejected[:] = False
    return rejected, sigma
