"""Where the noise of a face comes from: repeat scans, the manifest, or the scan itself.

A single scan identifies the noise that differs from point to point; noise that is correlated over the
filter's width is confounded with the surface. Two scans of one face identify both: the difference of their
filtered surfaces is noise that the filter passes, whatever its correlation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from metro.surface.areal import cell_size, crop_margin, interior, make_grid, point_spacing
from metro.surface.cloud_passes import box_in_plane, cell_sums, survey
from metro.surface.noise import repeat_sigma
from metro.surface.noise_spectrum import BAND, Spectrum, assumed, difference_spectrum
from metro.surface.plane import plane_of_moments
from metro.surface.points import Points
from metro.units import MM, UM, Array

PITCHES = 6  # least nesting index of the filter
COARSEST = 4.0  # times the nesting index asked for: a cloud that needs a longer one is not filtered
NEIGHBOURS = 4
ROBUST = 2.33  # relative error of the square of a robust deviation, times √n
ORDER = 0.05  # chance of as much spatial order in noise below which a face is taken to have a shape


@dataclass(frozen=True)
class Noise:
    """Noise of one point and where the figure comes from.

    Attributes
    ----------
    sigma : standard deviation of a point. source : in words.
    relative : standard uncertainty of ``sigma``, relative.
    repeated : whether it comes from repeat scans. spectrum : of these, where they are dense.
    """

    sigma: float
    source: str
    relative: float = 0.0
    repeated: bool = False
    spectrum: Spectrum | None = None


def dense_noise(
    noise: Noise | None,
    residual: float,
    left: tuple[float, float],
    spacing: float,
    points: int,
) -> tuple[Noise, Spectrum]:
    """Return the noise of a dense scan, and its spectrum.

    Parameters
    ----------
    noise : as declared. residual : robust deviation of the points from the filtered surface.
    left : share that this holds of the variance of white noise, and of noise blurred by a millimetre.
    spacing : pitch of the points. points : number of them.
    """
    density = spacing**-2
    off = ROBUST / np.sqrt(points)  # of the variance of the residual, relative
    if noise is None:
        alone = residual / float(np.sqrt(left[0]))
        return Noise(alone, "local residual, a lower bound"), assumed(alone, 0.0, density)
    if noise.spectrum is not None:
        return noise, noise.spectrum
    # The excess of the declared noise over the residual is correlated; its length is not declared.
    beyond, error = left[0] * noise.sigma**2 - residual**2, off * residual**2
    if beyond < 2 * error:
        return noise, assumed(noise.sigma, 0.0, density)
    variance = noise.sigma**2
    correlated = min(variance, beyond / (left[0] - min(left[1], 0.9 * left[0])))
    white = float(np.sqrt(variance - correlated))
    return noise, assumed(white, float(np.sqrt(correlated)), density, float(error / beyond))


def repeat_noise(scans: Sequence[Points], nesting_index: float) -> Noise:
    """Return the noise by scans of one face that was not touched between them, (n, 3) each, in one frame.

    Of touched points that are too few for a filter, the same points are needed in the same order.

    Raises
    ------
    ValueError
        Where the scans do not show the same part of a plane, or not the same points.
    """
    seen = survey(scans[0])
    spacing = point_spacing(seen.moments)
    source = f"{'two' if len(scans) == 2 else len(scans)} scans of the face"
    if not filterable(spacing, nesting_index):
        clouds = [np.asarray(scan[:], dtype=np.float64) for scan in scans]
        dof = (len(clouds) - 1) * (len(clouds[0]) - 3)
        return Noise(repeat_sigma(*clouds), source, float(1 / np.sqrt(2 * dof)), repeated=True)
    frame = plane_of_moments(seen.moments)
    boxes = [box_in_plane(frame, survey(scan)) for scan in scans]
    low, high = np.min([b[0] for b in boxes], axis=0), np.max([b[1] for b in boxes], axis=0)
    grid = make_grid(low, high, cell_size(spacing, max(nesting_index, PITCHES * spacing)))
    sums = [cell_sums(scan, frame, grid) for scan in scans]
    inside = np.all([interior(each, crop_margin(spacing, nesting_index, MM)) for each in sums], axis=0)
    if np.count_nonzero(inside) < 4 * BAND:
        raise ValueError("the scans do not show the same part of the face")
    spectrum = difference_spectrum(sums, inside)
    white = spectrum.density[-1] / spacing**2  # at the cells' own wavelength noise is white
    correlated = spectrum.density - spectrum.density[-1]
    k = spectrum.wavenumber
    variance = white + max(0.0, float(np.trapezoid(2 * np.pi * k * correlated, k)))
    return Noise(float(np.sqrt(variance)), source, repeated=True, spectrum=spectrum)


def filterable(spacing: float, nesting_index: float) -> bool:
    """Whether points of this pitch are dense enough for the filter, or one not much longer."""
    return PITCHES * spacing <= COARSEST * nesting_index


def sparse_noise(coordinates: Array, deviations: Array, noise: Noise | None) -> Noise:
    """Return the noise of a few touched points ``coordinates`` (n, 2), ``deviations`` (n,).

    Where neighbours are no more correlated than points far apart, no shape is distinguishable from noise, and
    all of the scatter counts as noise. An error that both of two scans have at the same points is a shape for
    their difference, but not for this test.
    """
    if noise is not None and not noise.repeated:
        return noise
    dof = len(deviations) - 3
    if dof >= 10 and (chance := spatial_order(coordinates, deviations)) > ORDER:
        scatter = float(np.sqrt(deviations @ deviations / dof))
        source = f"scatter of the points, without order over the face (p = {chance:.2f})"
        if noise is not None:
            source += f"; {noise.source} differ by {noise.sigma / UM:.1f} µm per point"
        if noise is None or scatter > noise.sigma:
            return Noise(scatter, source, float(1 / np.sqrt(2 * dof)), noise is not None)
    return noise or Noise(0.0, "unknown")


def spatial_order(coordinates: Array, deviations: Array) -> float:
    """Return the chance that noise correlates neighbours as much: Moran's I, four nearest neighbours.

    Normal approximation of I under independence (Cliff & Ord 1981), one-sided.
    """
    from scipy.spatial import cKDTree
    from scipy.special import ndtr

    number = len(deviations)
    near = cKDTree(coordinates).query(coordinates, NEIGHBOURS + 1)[1][:, 1:]
    one, other = np.repeat(np.arange(number), NEIGHBOURS), near.ravel()
    pair, times = np.unique(np.concatenate([one * number + other, other * number + one]), return_counts=True)
    weight, (i, j) = times / 2, np.divmod(pair, number)
    centred = deviations - deviations.mean()
    total, mean = float(weight.sum()), -1 / (number - 1)
    likeness = number / total * float(weight @ (centred[i] * centred[j])) / float(centred @ centred)
    s1 = 2 * float(weight @ weight)
    s2 = 4 * float(np.sum(np.bincount(i, weights=weight, minlength=number) ** 2))
    variance = (number**2 * s1 - number * s2 + 3 * total**2) / ((number**2 - 1) * total**2) - mean**2
    return float(ndtr(-(likeness - mean) / np.sqrt(variance)))
