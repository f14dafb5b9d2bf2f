"""The surface under noise: the modes of a scan, the estimate of the surface from them, and its uncertainty.

In cosine modes over the face noise is independent from mode to mode, whatever its correlation along the face.
Where the power about a mode exceeds that of the noise, the excess is the surface's, and Wiener's filter gives
its share of each mode. A dome or a twist has no short sum of cosines, since its slope does not vanish at
the edges: polynomials over the face are taken out first (Eubank & Speckman 1990), each total degree shrunk
as a whole (James & Stein 1961).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.surface.areal import TRUNCATE, CellSums, filter_width
from metro.surface.noise_spectrum import Spectrum, wavenumbers
from metro.units import Array

BLOCK = 7  # modes a side over which power is averaged
FALSE = 0.05  # modes of noise alone that pass for surface, per face
DEGREE = 8  # of the polynomials, in all
FORM = 4  # degree up to which they are the face's form and kept as they are


@dataclass(frozen=True)
class Estimate:
    """Modes of a surface, and the standard deviation of what is not known of each, in the grid's shape.

    ``unknown_form`` (d, d) is that of the polynomials, ``unknown`` that of the modes of the residual.
    """

    modes: Array
    unknown: Array
    unknown_form: Array


@dataclass(frozen=True)
class Modes:
    """A scan's cosine modes and the power of noise in each, in the grid's shape; ``cell`` of the grid.

    ``along``, ``across``: cosine modes (rows, d), (columns, d) of orthonormal polynomials over the grid, and
    ``form_noise`` (d, d) the power of noise in their products. ``doubt``: relative uncertainty of ``noise``.
    """

    scanned: Array
    noise: Array
    doubt: Array
    cell: float
    along: Array
    across: Array
    form_noise: Array

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

    def estimate(self, modes: Array) -> Estimate:
        """Estimate the surface from the ``modes`` of a scan with this noise."""
        form = self.along.T @ modes @ self.across
        kept = _kept_form(form**2 / self.form_noise)
        form = self.along @ (kept * form) @ self.across.T
        residual = modes - form
        share = _kept(residual**2 / self.noise)
        return Estimate(form + share * residual, np.sqrt(share * self.noise), np.sqrt(kept * self.form_noise))

    def drawn(self, estimate: Estimate, random: np.random.Generator) -> Array:
        """Draw the modes of a possible error of an estimate."""
        form = estimate.unknown_form * random.standard_normal(estimate.unknown_form.shape, dtype=np.float32)
        error = estimate.unknown * random.standard_normal(estimate.unknown.shape, dtype=np.float32)
        return np.asarray(error + self.along @ form @ self.across.T)


def field(modes: Array) -> Array:
    """Return the surface of cosine modes on the grid's cells."""
    from scipy.fft import idctn

    return np.asarray(idctn(modes, norm="ortho"))


def finer(modes: Array, per_cell: float) -> Array:
    """Return the surface on a grid twice as fine, as it is at points: modes are of means over cells.

    A mean of m points a side passes sin(π f) / (m sin(π f/m)) of a wave of f cycles a cell.
    """
    side = max(1.0, np.sqrt(per_cell))
    for axis, size in enumerate(modes.shape):
        f = np.maximum(np.arange(size) / (2 * size), 1e-9)
        passed = np.sin(np.pi * f) / (side * np.sin(np.pi * f / side))
        modes = modes / np.expand_dims(passed, 1 - axis)
    return 2 * field(np.pad(modes, [(0, size) for size in modes.shape]))


def _kept_form(power: Array) -> Array:
    """Return the share of each polynomial (d, d) that is the surface's, by its power over that of noise."""
    kept = np.zeros_like(power)
    degree = np.add.outer(np.arange(len(power)), np.arange(len(power)))
    kept[degree <= FORM] = 1.0
    for total in range(FORM + 1, len(power)):
        same = degree == total
        kept[same] = max(0.0, 1 - 1 / float(power[same].mean()))
    return kept


def _kept(power: Array) -> Array:
    """Return the share of each mode that is the surface's, by its power over that of noise."""
    from scipy.ndimage import uniform_filter
    from scipy.special import gammaincinv

    line = np.float32(2 * gammaincinv(0.5, 1 - FALSE / power.size))
    around = uniform_filter(np.minimum(power, line), size=BLOCK, mode="reflect")
    freedom = BLOCK**2
    least = np.float32(2 * gammaincinv(freedom / 2, 1 - FALSE / power.size) / freedom)
    stands = np.where(power > line, power, np.where(around > least, around, np.float32(1.0)))
    return np.asarray(1 - 1 / stands)


def modes_of_scan(sums: CellSums, smooth: Array, noise: Spectrum) -> Modes:
    """Return the cosine modes of the cell means of a scan, and of its noise.

    ``smooth``: a filtered surface that replaces the cells without points.
    """
    from scipy.fft import dct, dctn

    covered = sums.count > 0
    means = np.where(covered, sums.total / np.maximum(sums.count, 1), _filled(smooth))
    cell = sums.grid.cell
    k = wavenumbers(means.shape, cell)
    power: Array = np.asarray(noise.at(k) / cell**2 * float(covered.mean()), np.float32)
    along, across = (
        dct(np.linalg.qr(np.linspace(-1, 1, size)[:, None] ** np.arange(DEGREE + 1))[0], axis=0, norm="ortho")
        for size in means.shape
    )
    return Modes(
        dctn(means, norm="ortho").astype(np.float32),
        power,
        noise.doubt_at(k).astype(np.float32),
        cell,
        along.astype(np.float32),
        across.astype(np.float32),
        ((along**2).T @ power @ across**2).astype(np.float32),
    )


def _filled(field: Array) -> Array:
    """Give cells without a value that of the nearest with one."""
    from scipy.ndimage import distance_transform_edt

    missing = np.isnan(field)
    if not missing.any():
        return field
    near = distance_transform_edt(missing, return_distances=False, return_indices=True)
    return np.asarray(field[tuple(near)])
