"""Noise of a scanned face by wavenumber: the assumed spectrum, and the estimate from two scans."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from metro.surface.areal import GAUSSIAN, CellSums
from metro.surface.noise import contrasts
from metro.units import MM, Array

CORRELATION = 1 * MM  # deviation of the blur that makes noise of unknown correlation out of white noise
BAND = 24  # modes in the first band of a measured spectrum


@dataclass(frozen=True)
class Spectrum:
    """Power density of noise, m² per (1/m)², over the wavenumber, 1/m; the last holds beyond.

    ``doubt`` is the relative standard uncertainty of the density, of each or of all.
    """

    wavenumber: Array
    density: Array
    doubt: Array | float = 0.0

    def at(self, wavenumber: Array) -> Array:
        """Return the density at each wavenumber, of any shape."""
        return np.asarray(np.interp(wavenumber, self.wavenumber, self.density))

    def doubt_at(self, wavenumber: Array) -> Array:
        """Return the relative uncertainty of the density at each wavenumber, of any shape."""
        doubt = np.broadcast_to(self.doubt, self.density.shape)
        return np.asarray(np.interp(wavenumber, self.wavenumber, doubt))

    def through(self, nesting_index: float) -> float:
        """Return the standard deviation of the noise that passes the areal filter."""
        k = np.linspace(0, 3 / nesting_index, 600)
        return float(np.sqrt(np.trapezoid(2 * np.pi * k * self.at(k) * transfer(k, nesting_index) ** 2, k)))


def transfer(wavenumber: Array, nesting_index: float) -> Array:
    """Return what the areal Gaussian filter passes of a wave."""
    return np.asarray(np.exp(-2 * (np.pi * GAUSSIAN * nesting_index * wavenumber) ** 2))


def assumed(white: float, correlated: float, density: float, off: float = 0.0) -> Spectrum:
    """Return the spectrum of ``white`` noise per point and ``correlated`` noise blurred by ``CORRELATION``.

    ``density`` : points per m². ``off`` : relative standard uncertainty of the variance of the latter.
    """
    k = np.linspace(0, 1.2 / CORRELATION, 200)
    blurred = 4 * np.pi * (correlated * CORRELATION) ** 2 * np.exp(-((2 * np.pi * CORRELATION * k) ** 2))
    total = white**2 / density + blurred
    return Spectrum(k, total, off * blurred / np.maximum(total, np.finfo(float).tiny))


def wavenumbers(shape: tuple[int, int], cell: float) -> Array:
    """Return the wavenumber of each cosine mode of a grid, in its shape."""
    rows, columns = (np.arange(size) / (2 * size * cell) for size in shape)
    return np.asarray(np.hypot(rows[:, None], columns))


def difference_spectrum(scans: Sequence[CellSums], inside: np.ndarray) -> Spectrum:
    """Return the noise of one scan by the cell means of two or more, where all cover ``inside``.

    The scans may lie planes apart. Cells outside are taken as the mean: the noise of the others fills less of
    the rectangle about them, and the density is raised accordingly.
    """
    from scipy.fft import dctn

    with np.errstate(invalid="ignore", divide="ignore"):
        means = np.array([each.total / each.count for each in scans])
    seen = inside & np.isfinite(means).all(axis=0)
    # of a rectangle without a rim of zeros, which would spread the power
    rows, columns = (slice(int(at.min()), int(at.max()) + 1) for at in np.nonzero(seen))
    seen, cell = seen[rows, columns], scans[0].grid.cell
    differ = np.tensordot(contrasts(len(scans)), means[:, rows, columns], axes=1)
    fields = [np.where(seen, without_plane(each, seen), 0.0) for each in differ]
    power = np.mean([dctn(field, norm="ortho") ** 2 for field in fields], axis=0) * cell**2 / seen.mean()
    k = wavenumbers(seen.shape, cell).ravel()
    # bands that double in size: the first few modes hold most of what the filter passes
    order = np.argsort(k)
    starts = np.array([0, *(BAND * 2 ** np.arange(int(np.log2(k.size / BAND))))])
    number = np.diff(np.append(starts, k.size))
    centre = np.add.reduceat(k[order], starts) / number
    number[0] -= 3  # the plane's
    density = np.add.reduceat(power.ravel()[order], starts) / number
    return Spectrum(centre, density, np.sqrt(2 / (number * seen.mean() * len(differ))))


def without_plane(field: Array, inside: np.ndarray) -> Array:
    """Return the field less its least-squares plane over the mask."""
    row, column = np.indices(field.shape)
    basis = np.stack([np.ones(field.shape), row, column], axis=-1)
    return np.asarray(field - basis @ np.linalg.lstsq(basis[inside], field[inside], rcond=None)[0])
