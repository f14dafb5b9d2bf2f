"""A face measured: from its cloud to flatness indices, each with the bias and uncertainty by noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.surface.areal import (
    Grid,
    cell_size,
    crop_margin,
    gaussian_s_filter,
    interior,
    local_outliers,
    make_grid,
    point_spacing,
    residual_share,
)
from metro.surface.cloud_passes import (
    Residuals,
    Survey,
    box_in_plane,
    cell_sums,
    raw_readings,
    residuals,
    survey,
)
from metro.surface.denoise import modes_of_scan
from metro.surface.face_noise import PITCHES, Noise, dense_noise, filterable, sparse_noise
from metro.surface.indices import Index, iso_indices, raw_indices, symmetric
from metro.surface.minimum_zone import MinimumZone, minimum_zone
from metro.surface.noise import noise_bias, shrink
from metro.surface.noise_spectrum import CORRELATION
from metro.surface.plane import Plane, fit_plane, moments_of_columns, plane_of_moments
from metro.surface.points import Points
from metro.surface.under_noise import corrected
from metro.units import MM, Array

NESTING_INDEX = 2.5 * MM
CROP_TOLERANCE = 0.05


@dataclass(frozen=True)
class Face:
    """The measures of a face, from its cloud; lengths in the unit of the cloud (SI).

    Attributes
    ----------
    indices : name → :class:`Index`: xm, xa, xg, percentile_range of the raw points; fltt, fltp, fltv, fltq
        and minimum_zone of the filtered surface (absent where the cloud is too sparse for a filter).
    map_points : (c, 3) points of the filtered surface (of the cloud, where nothing was filtered) within the
        crop, with ``map_deviations`` (c,) from its least-squares plane.
    zone : minimum zone of ``map_points``.
    nesting_index : of the areal filter; None where it was not applied.
    noise : of one point, and where the figure comes from.
    local_sigma : robust residual of the points from the filtered surface; lower than the noise where that is
        correlated.
    scanned, outliers : number of all points; places, ascending, of those that differ from their
    surroundings.
    points, spacing, margin : number used within the crop; pitch; width of the rim cropped.
    xm_inner : X_m with one more millimetre cropped; ``crop_holds`` where it changes by less than 5 %.
    """

    plane: Plane
    indices: dict[str, Index]
    map_points: Array
    map_deviations: Array
    zone: MinimumZone
    nesting_index: float | None
    noise: Noise
    local_sigma: float
    scanned: int
    outliers: np.ndarray
    points: int
    spacing: float
    margin: float
    xm_inner: float

    @property
    def sigma(self) -> float:
        """Noise of one point."""
        return self.noise.sigma

    @property
    def sigma_source(self) -> str:
        """Where the noise of one point comes from, in words."""
        return self.noise.source

    @property
    def crop_holds(self) -> bool:
        """Whether the edge no longer rules X_m."""
        return abs(self.xm_inner - self.indices["xm"].value) <= CROP_TOLERANCE * self.indices["xm"].value


def measure_face(
    cloud: Points,
    sigma: float | None = None,
    source: str = "",
    nesting_index: float = NESTING_INDEX,
    step: float = 0.0,
    *,
    repeats: Noise | None = None,
    uncertainty: bool = True,
) -> Face:
    """Measure the flatness of ``cloud`` (n, 3) in metres, read slice by slice.

    Parameters
    ----------
    sigma, source : noise of one point and where it comes from (the manifest); None: the local residual is
        taken, a lower bound, since noise that is correlated over the filter's width is confounded with the
        surface (of a face of a few touched points: their scatter, where it has no order).
    nesting_index : of the areal Gaussian filter, m; raised to six pitches where the cloud is too sparse for
        it.
    step : rounding step of the coordinates, m.
    repeats : the noise estimated from repeat scans of the same face; it takes precedence over ``sigma``.
    uncertainty : False leaves bias and deviation of the indices of a filtered face NaN, and is faster.

    Raises
    ------
    ValueError
        Where the points define no plane.
    """
    noise = repeats if repeats is not None else Noise(sigma, source) if sigma else None
    seen = survey(cloud)
    plane = plane_of_moments(seen.moments)
    spacing = point_spacing(seen.moments)
    if not filterable(spacing, nesting_index):
        return _sparse_face(np.asarray(cloud[:], dtype=np.float64), plane, spacing, noise, step)
    return _dense_face(
        cloud,
        seen,
        plane,
        nesting_index=max(nesting_index, PITCHES * spacing),
        noise=noise,
        step=step,
        uncertainty=uncertainty,
    )


def _dense_face(
    cloud: Points,
    seen: Survey,
    plane: Plane,
    *,
    nesting_index: float,
    noise: Noise | None,
    step: float,
    uncertainty: bool,
) -> Face:
    spacing = point_spacing(seen.moments)
    sums = cell_sums(cloud, plane, make_grid(*box_in_plane(plane, seen), cell_size(spacing, nesting_index)))
    margin = crop_margin(spacing, nesting_index, MM)
    inside = interior(sums, margin)
    if not inside.any():
        raise ValueError(f"the face is narrower than the rim of {margin / MM:.2f} mm that its edges disturb")
    smooth = gaussian_s_filter(sums, nesting_index)
    residual = residuals(cloud, plane, sums.grid, smooth.ravel(), inside.ravel())
    rejected, local_sigma, sums = local_outliers(
        sums, residual.sample, residual.suspects, seen.moments.count, nesting_index
    )
    depth = inside.astype(np.uint8) + (inside & interior(sums, margin + MM))
    gone = np.sort(residual.place[rejected])
    exact = _plane_of_crop(plane, residual, rejected, inside)
    raw, xm_inner, points = raw_readings(
        cloud, (plane, exact), sums.grid, depth.ravel(), rejected=gone, sample=residual.sample, step=step
    )
    # the filtered surface follows each point a little, and noise that is correlated more
    white, blurred = (residual_share(sums, nesting_index, length) for length in (0.0, CORRELATION))
    scan_noise, spectrum = dense_noise(noise, local_sigma, (white, blurred), spacing, points)
    smooth = gaussian_s_filter(sums, nesting_index)
    map_points = _in_space(sums.grid, plane, smooth, inside)
    smooth_plane = fit_plane(map_points)
    deviations, zone = smooth_plane.deviations(map_points), minimum_zone(map_points)
    readings = raw | iso_indices(deviations) | {"minimum_zone": zone.width}
    if uncertainty:
        modes = modes_of_scan(sums, smooth, spectrum)
        indices = corrected(readings, modes, sums=sums, inside=inside, nesting_index=nesting_index)
    else:
        indices = {name: Index(value, *[float("nan")] * 3) for name, value in readings.items()}
    return Face(
        plane=smooth_plane,
        indices=indices,
        map_points=map_points,
        map_deviations=deviations,
        zone=zone,
        nesting_index=nesting_index,
        noise=scan_noise,
        local_sigma=local_sigma / float(np.sqrt(white)),
        scanned=seen.moments.count,
        outliers=gone,
        points=points,
        spacing=spacing,
        margin=margin,
        xm_inner=xm_inner,
    )


def _plane_of_crop(frame: Plane, residual: Residuals, rejected: np.ndarray, inside: np.ndarray) -> Plane:
    """Plane of all points within the crop but those rejected, in space."""
    back = ~rejected & inside.ravel()[residual.suspects.cells]
    moments = residual.sound
    if back.any():
        moments = moments.merge(moments_of_columns(residual.coordinates[:, back]))
    local = plane_of_moments(moments)
    turn = np.vstack([frame.axes, frame.normal])
    return Plane(frame.point + local.point @ turn, local.normal @ turn, local.axes @ turn)


def _in_space(grid: Grid, plane: Plane, field: Array, inside: np.ndarray) -> Array:
    """Points (c, 3) of a surface over the grid's cells, within the mask."""
    points = plane.point + grid.centres()[inside.ravel()] @ plane.axes
    return np.asarray(points + field[inside][:, None] * plane.normal)


def _sparse_face(cloud: Array, plane: Plane, spacing: float, known: Noise | None, step: float) -> Face:
    """Measure a face of a few touched points: no filter, so no ISO index; noise taken out by shrinkage."""
    deviations, zone = plane.deviations(cloud), minimum_zone(cloud)
    noise = sparse_noise(plane.coordinates(cloud), deviations, known)
    readings = raw_indices(deviations, step)

    def bias(sigma: float) -> dict[str, tuple[float, float]]:
        return noise_bias(shrink(deviations, sigma), sigma, len(cloud), len(cloud))

    at, off = bias(noise.sigma), bias(noise.sigma * (1 + noise.relative))
    indices = {"percentile_range": symmetric(readings.pop("percentile_range"), 0.0, float("nan"))}
    for name, value in readings.items():  # what is not known of the noise is not known of the bias
        u = float(np.hypot(at[name][1], off[name][0] - at[name][0]))
        indices[name] = symmetric(value, at[name][0], u)
    xm = indices["xm"]
    return Face(
        plane=plane,
        indices=indices | {"minimum_zone": symmetric(zone.width, xm.bias, xm.sd)},
        map_points=cloud,
        map_deviations=deviations,
        zone=zone,
        nesting_index=None,
        noise=noise,
        local_sigma=float("nan"),
        scanned=len(cloud),
        outliers=np.empty(0, dtype=np.intp),
        points=len(cloud),
        spacing=spacing,
        margin=0.0,
        xm_inner=readings["xm"],
    )
