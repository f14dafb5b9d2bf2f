"""Noise of a scanned face by wavenumber, and the surface under it as draws of what it may be.

In cosine modes over the face noise is independent from mode to mode, whatever its correlation along the face,
and so is the surface, near enough. Where the power about a mode is more than noise gives, the excess is the
surface's, and Wiener's filter tells how much of each mode is. Draws of the modes give draws of the surface,
of which every index can be read: an extreme of a noisy surface is biased by what the noise adds to it, that
of a draw is not.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from metro.surface.areal import GAUSSIAN, TRUNCATE, CellSums, filter_width
from metro.units import MM, Array

CORRELATION = 1 * MM  # deviation of the blur that makes noise of unknown correlation out of white noise
BLOCK = 7  # modes a side over which power is averaged
LINE = 15.0  # power over that of noise, above which a mode stands for itself and does not lift its neighbours
FALSE = 0.01  # chance that noise alone passes for surface at a mode
PAIRS = 32
BANDS = 12


@dataclass(frozen=True)
class Spectrum:
    """Power density of noise, m² per (1/m)², over the wavenumber, 1/m; the last holds beyond."""

    wavenumber: Array
    density: Array

    def at(self, wavenumber: Array) -> Array:
        """Return the density at each wavenumber, of any shape."""
        return np.asarray(np.interp(wavenumber, self.wavenumber, self.density))

    def through(self, nesting_index: float) -> float:
        """Return the standard deviation of the noise that passes the areal filter."""
        k = np.linspace(0, 3 / nesting_index, 600)
        return float(np.sqrt(np.trapezoid(2 * np.pi * k * self.at(k) * transfer(k, nesting_index) ** 2, k)))


def transfer(wavenumber: Array, nesting_index: float) -> Array:
    """Return what the areal Gaussian filter passes of a wave."""
    return np.asarray(np.exp(-2 * (np.pi * GAUSSIAN * nesting_index * wavenumber) ** 2))


def assumed(white: float, correlated: float, density: float) -> Spectrum:
    """Return the spectrum of ``white`` noise per point and ``correlated`` noise blurred by ``CORRELATION``.

    ``density`` : points per m².
    """
    k = np.linspace(0, 1.2 / CORRELATION, 200)
    blurred = 4 * np.pi * (correlated * CORRELATION) ** 2 * np.exp(-((2 * np.pi * CORRELATION * k) ** 2))
    return Spectrum(k, white**2 / density + blurred)


def wavenumbers(shape: tuple[int, int], cell: float) -> Array:
    """Return the wavenumber of each cosine mode of a grid, in its shape."""
    rows, columns = (np.arange(size) / (2 * size * cell) for size in shape)
    return np.asarray(np.hypot(rows[:, None], columns))


def difference_spectrum(first: CellSums, second: CellSums, inside: np.ndarray) -> Spectrum:
    """Return the noise of one scan by the cell means of two, where both cover ``inside``.

    The pair may lie a plane apart. Cells outside are taken as the mean: the noise of the others fills less of
    the grid, and the density is raised accordingly.
    """
    from scipy.fft import dctn

    with np.errstate(invalid="ignore", divide="ignore"):
        means = [each.total / each.count for each in (first, second)]
    seen = inside & np.isfinite(means[0]) & np.isfinite(means[1])
    field = np.where(seen, without_plane(means[1] - means[0], seen), 0.0) / np.sqrt(2)
    cell = first.grid.cell
    power = dctn(field, norm="ortho") ** 2 * cell**2 / seen.mean()
    k = wavenumbers(field.shape, cell).ravel()
    # three modes are the plane's; the first band is wide enough that this hardly matters
    edges = np.linspace(0, k.max(), BANDS + 1)
    band = np.clip(np.searchsorted(edges, k, side="right") - 1, 0, BANDS - 1)
    number = np.bincount(band, minlength=BANDS)
    enough = number > 20
    number = np.maximum(number, 1)
    centre = np.bincount(band, weights=k, minlength=BANDS) / number
    return Spectrum(
        centre[enough], (np.bincount(band, weights=power.ravel(), minlength=BANDS) / number)[enough]
    )


def without_plane(field: Array, inside: np.ndarray) -> Array:
    """Return the field less its least-squares plane over the mask."""
    row, column = np.indices(field.shape)
    basis = np.stack([np.ones(field.shape), row, column], axis=-1)
    return np.asarray(field - basis @ np.linalg.lstsq(basis[inside], field[inside], rcond=None)[0])


@dataclass(frozen=True)
class Modes:
    """A scan's cosine modes and the power of noise in each, in the grid's shape; ``cell`` of the grid."""

    scanned: Array
    noise: Array
    cell: float

    def through(self, nesting_index: float) -> Array:
        """Return what the areal filter, as it runs on the grid's cells, passes of each mode."""
        from scipy.ndimage import gaussian_filter1d

        reach = int(5 * nesting_index / self.cell)
        impulse = np.eye(1, 2 * reach + 1, reach)[0]
        kernel = gaussian_filter1d(
            impulse, filter_width(self.cell, nesting_index), mode="constant", truncate=TRUNCATE
        )
        along = np.arange(-reach, reach + 1)
        rows, columns = (
            np.cos(np.pi * np.outer(np.arange(size) / size, along)) @ kernel for size in self.scanned.shape
        )
        return np.asarray(np.outer(rows, columns), np.float32)

    def estimate(self) -> Array:
        """Return the modes of the surface by Wiener's filter."""
        return _shrunk(self.scanned, self.noise)

    def again(self) -> Iterator[Array]:
        """Give what the estimate would be of other scans, were the estimate the surface; in pairs."""
        random = np.random.default_rng(0)
        surface, sd = self.estimate(), np.sqrt(self.noise)
        for _ in range(PAIRS):
            noise = sd * random.standard_normal(sd.shape, dtype=np.float32)
            yield _shrunk(surface + noise, self.noise)
            yield _shrunk(surface - noise, self.noise)


def field(modes: Array) -> Array:
    """Return the surface of cosine modes on the grid's cells."""
    from scipy.fft import idctn

    return np.asarray(idctn(modes, norm="ortho"))


def _shrunk(modes: Array, noise: Array) -> Array:
    from scipy.ndimage import uniform_filter
    from scipy.special import gammaincinv

    power = modes**2 / noise
    around = uniform_filter(np.minimum(power, LINE), size=BLOCK, mode="reflect")
    freedom = BLOCK**2
    least = np.float32(2 * gammaincinv(freedom / 2, 1 - FALSE) / freedom)
    stands = np.where(power > LINE, power, np.where(around > least, around, np.float32(1.0)))
    return np.asarray((1 - 1 / stands) * modes)


def modes_of_scan(sums: CellSums, smooth: Array, noise: Spectrum) -> Modes:
    """Return the cosine modes of the cell means of a scan, and of its noise.

    ``smooth``: a filtered surface that stands for the cells without points.
    """
    from scipy.fft import dctn

    covered = sums.count > 0
    means = np.where(covered, sums.total / np.maximum(sums.count, 1), _filled(smooth))
    cell = sums.grid.cell
    power = noise.at(wavenumbers(means.shape, cell)) / cell**2 * float(covered.mean())
    return Modes(dctn(means, norm="ortho").astype(np.float32), power.astype(np.float32), cell)


def _filled(field: Array) -> Array:
    """Give cells without a value that of the nearest with one."""
    from scipy.ndimage import distance_transform_edt

    missing = np.isnan(field)
    if not missing.any():
        return field
    near = distance_transform_edt(missing, return_distances=False, return_indices=True)
    return np.asarray(field[tuple(near)])
