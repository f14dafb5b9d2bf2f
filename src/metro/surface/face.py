"""A face measured: from its cloud to flatness indices, each with the bias and uncertainty by noise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from metro.surface.areal import (
    crop_margin,
    gaussian_s_filter,
    interior,
    local_outliers,
    make_grid,
    point_spacing,
    point_weights,
)
from metro.surface.indices import iso_indices, raw_indices
from metro.surface.minimum_zone import MinimumZone, minimum_zone
from metro.surface.noise import field_peaks, noise_bias, shrink
from metro.surface.plane import Plane, fit_plane
from metro.units import MM, Array

NESTING_INDEX = 2.5 * MM
FORM = 3.2  # nesting index of what stands for the true surface in estimates of bias, over the filter's
CROP_TOLERANCE = 0.05
BIAS_OF = {"fltt": "xm", "fltp": "peak", "fltv": "valley", "fltq": "xq", "minimum_zone": "xm"}


@dataclass(frozen=True)
class Index:
    """A flatness index as read, its bias by noise (read minus true) and its standard deviation by noise."""

    value: float
    bias: float
    sd: float

    @property
    def corrected(self) -> float:
        """The reading less its bias; an index is not negative."""
        return max(0.0, self.value - self.bias)


@dataclass(frozen=True)
class Face:
    """What a cloud says about a face; lengths in the unit of the cloud (SI).

    Attributes
    ----------
    indices : name → :class:`Index`: xm, xa, xg, percentile_range of the raw points; fltt, fltp, fltv, fltq
        and minimum_zone of the filtered surface (absent where the cloud is too sparse for a filter).
    map_points : (c, 3) points of the filtered surface (of the cloud, where nothing was filtered) within the
        crop, with ``map_deviations`` (c,) from its least-squares plane.
    zone : minimum zone of ``map_points``.
    nesting_index : of the areal filter; None where it was not applied.
    sigma, sigma_source : noise of one point, and where the figure comes from.
    local_sigma : robust residual of the points from the filtered surface; lower than sigma where noise is
        correlated.
    rejected : (n,) mask of the points that stand out of their surroundings.
    points, spacing, margin : number used within the crop; pitch; width of the rim cropped.
    xm_inner : X_m with one more millimetre cropped; ``crop_holds`` where it changes by less than 5 %.
    """

    plane: Plane
    indices: dict[str, Index]
    map_points: Array
    map_deviations: Array
    zone: MinimumZone
    nesting_index: float | None
    sigma: float
    sigma_source: str
    local_sigma: float
    rejected: np.ndarray
    points: int
    spacing: float
    margin: float
    xm_inner: float

    @property
    def crop_holds(self) -> bool:
        """Whether the edge no longer rules X_m."""
        return abs(self.xm_inner - self.indices["xm"].value) <= CROP_TOLERANCE * self.indices["xm"].value


def measure_face(
    cloud: Array, sigma: float | None, source: str, nesting_index: float = NESTING_INDEX, step: float = 0.0
) -> Face:
    """Measure the flatness of ``cloud`` (n, 3) in metres.

    Parameters
    ----------
    sigma, source : noise of one point and where it comes from (repeat scans, the manifest); None: the local
        residual is taken, a lower bound, since noise that is correlated over the filter's width cannot be
        told from the surface.
    nesting_index : of the areal Gaussian filter, m; raised to six pitches where the cloud is too sparse for
        it.
    step : rounding step of the coordinates, m.

    Raises
    ------
    ValueError
        Where the points define no plane.
    """
    plane = fit_plane(cloud)
    coordinates, deviations = plane.coordinates(cloud), plane.deviations(cloud)
    spacing = point_spacing(coordinates)
    if 6 * spacing > 4 * nesting_index:
        return _sparse_face(cloud, plane, spacing, (sigma, source) if sigma else (0.0, "unknown"), step)
    nesting_index = max(nesting_index, 6 * spacing)
    grid = make_grid(coordinates, 2 * spacing)
    rejected, local_sigma = local_outliers(grid, deviations, nesting_index)
    kept = ~rejected
    grid = replace(grid, cells=grid.cells[kept])
    own, squares = point_weights(grid, nesting_index)
    local_sigma /= np.sqrt(1 - 2 * own + squares)  # the filtered surface follows each point a little
    noise, source = (sigma, source) if sigma else (local_sigma, "local residual, a lower bound")
    margin = crop_margin(spacing, nesting_index, MM)
    inside = interior(grid, margin)
    if not inside.any():
        raise ValueError(f"the face is narrower than the rim of {margin / MM:.2f} mm that its edges disturb")
    surface = gaussian_s_filter(grid, deviations[kept], nesting_index)[inside]
    points = _points_in_space(plane, grid.centres()[inside.ravel()], surface)
    smooth_plane = fit_plane(points)
    smooth, zone = smooth_plane.deviations(points), minimum_zone(points)
    raw = _deviations_within(cloud[kept], inside.ravel()[grid.cells])
    inner = interior(grid, margin + MM).ravel()[grid.cells]
    readings = raw_indices(raw, step) | iso_indices(smooth) | {"minimum_zone": zone.width}
    white = min(local_sigma, noise)
    # what the declared noise has beyond the local residual is correlated, and passes the filter
    passed = float(np.sqrt(max(white**2 * squares, noise**2 - white**2)))
    cells = len(raw) * squares
    # the noise that passes acts on the true surface; the filtered one has it: a smoother one stands in
    form = gaussian_s_filter(grid, deviations[kept], FORM * nesting_index)[inside]
    low = noise_bias(form, passed, cells, field_peaks(cells))
    high = noise_bias(smooth, white, len(raw), len(raw))
    return Face(
        plane=smooth_plane,
        indices={name: _index(name, value, low, high) for name, value in readings.items()},
        map_points=points,
        map_deviations=smooth,
        zone=zone,
        nesting_index=nesting_index,
        sigma=noise,
        sigma_source=source,
        local_sigma=local_sigma,
        rejected=rejected,
        points=len(raw),
        spacing=spacing,
        margin=margin,
        xm_inner=float(np.ptp(_deviations_within(cloud[kept], inner))) if inner.any() else float("nan"),
    )


def _points_in_space(plane: Plane, coordinates: Array, deviations: Array) -> Array:
    return plane.point + coordinates @ plane.axes + deviations[:, None] * plane.normal


def _deviations_within(cloud: Array, inside: np.ndarray) -> Array:
    """Deviations of the points inside the crop from the plane of just these."""
    face = cloud[inside]
    return fit_plane(face).deviations(face)


def _index(
    name: str, value: float, low: dict[str, tuple[float, float]], high: dict[str, tuple[float, float]]
) -> Index:
    """Bias of an index: true → filtered surface (``low``), and for the raw ones filtered → raw (``high``)."""
    if name in BIAS_OF:
        return Index(value, *low[BIAS_OF[name]])
    if name not in high:  # a percentile range has no bias model: read as it is
        return Index(value, 0.0, float("nan"))
    return Index(value, low[name][0] + high[name][0], float(np.hypot(low[name][1], high[name][1])))


def _sparse_face(cloud: Array, plane: Plane, spacing: float, noise: tuple[float, str], step: float) -> Face:
    """Measure a face of a few touched points: no filter, so no ISO index; noise taken out by shrinkage."""
    sigma, source = noise
    deviations, zone = plane.deviations(cloud), minimum_zone(cloud)
    readings = raw_indices(deviations, step)
    bias = noise_bias(shrink(deviations, sigma), sigma, len(cloud), len(cloud))
    none = dict.fromkeys(bias, (0.0, 0.0))
    indices = {name: _index(name, value, none, bias) for name, value in readings.items()}
    return Face(
        plane=plane,
        indices=indices | {"minimum_zone": Index(zone.width, *bias["xm"])},
        map_points=cloud,
        map_deviations=deviations,
        zone=zone,
        nesting_index=None,
        sigma=sigma,
        sigma_source=source,
        local_sigma=float("nan"),
        rejected=np.zeros(len(cloud), dtype=bool),
        points=len(cloud),
        spacing=spacing,
        margin=0.0,
        xm_inner=readings["xm"],
    )
