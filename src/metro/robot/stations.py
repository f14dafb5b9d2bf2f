"""A tabulated machine: end stiffness at a few stations, and in between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import MM, Array

SPLINE_STATIONS = 10  # from here on a spline through the stations; fewer carry no more than a plane
MARGIN = 0.1  # how far beyond the stations' hull is still answered, as a share of their extent
SPLINE = "thin-plate spline of log stiffness"
PLANE = "linear polynomial of log stiffness, least squares"


@dataclass(frozen=True, eq=False)
class Stations:
    """Where the end stiffness of a machine was tabulated.

    Attributes
    ----------
    place : (n, 3) m, base frame.
    stiffness : (n, 3) N/m along the axes of the base frame, or (n, 3, 3) with the stiffness across, force =
        stiffness @ deflection. Anything else that is positive may be in its place, (n, d).
    """

    place: Array
    stiffness: Array

    @property
    def extent(self) -> float:
        """Largest distance between two stations, m."""
        return float(np.linalg.norm(self.place[:, None] - self.place[None, :], axis=2).max())

    @property
    def method(self) -> str:
        """How stiffness between the stations is had.

        The thin-plate spline passes through every station. It wants stations enough to be worth it that do
        not lie in one plane; fewer get a plane in log stiffness, level in directions they do not span.
        """
        offset = self.place - self.place.mean(axis=0)
        solid = np.linalg.matrix_rank(offset, tol=1e-6 * max(self.extent, 1e-12)) == 3
        return SPLINE if solid and len(self.place) >= SPLINE_STATIONS else PLANE

    @property
    def logarithm(self) -> Array:
        """Logarithm of the stiffness (n, d): of each value, or of the matrix, entry by entry.

        That of a diagonal matrix is the logarithms of its diagonal. The exponential of a mean of logarithms
        of positive definite matrices is positive definite (Arsigny et al. 2007).
        """
        if self.stiffness.ndim == 2:
            return np.asarray(np.log(self.stiffness))
        from scipy.linalg import logm

        # Of size one: the algorithm loses as many digits as the logarithm is large.
        size = np.linalg.norm(self.stiffness, axis=(1, 2))[:, None, None]
        scaled = np.array([np.real(logm(matrix)) for matrix in self.stiffness / size])
        return np.asarray(scaled + np.log(size) * np.eye(3)).reshape(-1, 9)

    def from_logarithm(self, values: Array) -> Array:
        """Return the stiffness (m, …) of logarithms (m, d)."""
        if self.stiffness.ndim == 2:
            return np.asarray(np.exp(values))
        from scipy.linalg import expm

        return np.asarray(expm(values.reshape(-1, 3, 3)))

    @property
    def unit(self) -> Array:
        """What an error of each entry of the stiffness counts relative to, (n, …) N/m.

        The entry itself; of the stiffness across two axes, the root of the product of the two along them.
        """
        if self.stiffness.ndim == 2:
            return self.stiffness
        along = np.diagonal(self.stiffness, axis1=1, axis2=2)
        return np.asarray(np.sqrt(along[:, :, None] * along[:, None, :]))


@dataclass(frozen=True, eq=False)
class EndStiffness:
    """Stiffness (3,) or (3, 3), N/m, at a place; ``beyond`` is how far outside the hull it lies, m."""

    value: Array
    method: str
    beyond: float


def stiffness_at(stations: Stations, place: Array) -> EndStiffness:
    """Interpolate the end stiffness at ``place`` (3,), m, base frame.

    The logarithm is what is interpolated: stiffness stays positive, and relative errors count alike
    everywhere.

    Raises
    ------
    ValueError
        If the place lies beyond the convex hull of the stations by more than ``MARGIN`` of their extent.
    """
    beyond, allowed = beyond_hull(stations.place, place), MARGIN * stations.extent
    if beyond > allowed + 1e-9:
        raise ValueError(
            f"({', '.join(f'{x / MM:.0f}' for x in place)}) mm lies {beyond / MM:.0f} mm beyond the "
            f"stations, expected at most {allowed / MM:.0f} mm"
        )
    return EndStiffness(stiffness_over(stations, place[None, :])[0], stations.method, beyond)


def stiffness_over(stations: Stations, places: Array) -> Array:
    """Interpolate the end stiffness (m, …), N/m, at ``places`` (m, 3), however far from the stations."""
    logarithms = _interpolated(stations.place, stations.logarithm, places, stations.method)
    return stations.from_logarithm(logarithms)


def leave_one_out(stations: Stations) -> Array:
    """Return the rms relative error, (…), of each station's stiffness predicted from all others.

    Stations on the hull are extrapolated to, so this is no less than the error between stations. NaN for a
    single station.
    """
    return np.asarray(np.sqrt(np.mean(left_out(stations) ** 2, axis=0)))


def left_out(stations: Stations) -> Array:
    """Relative error (n, …) of each station's stiffness predicted from all others; NaN for a single one."""
    count = len(stations.place)
    if count < 2:
        return np.full(stations.stiffness.shape, np.nan)
    logarithm, method = stations.logarithm, stations.method
    others = [np.arange(count) != i for i in range(count)]
    predicted = [
        _interpolated(stations.place[kept], logarithm[kept], stations.place[[i]], method)[0]
        for i, kept in enumerate(others)
    ]
    error = stations.from_logarithm(np.array(predicted)) - stations.stiffness
    return np.asarray(error / stations.unit)


def leave_one_out_interval(stations: Stations, level: float = 0.95) -> Array:
    """Interval (2, …) of the rms leave-one-out error, by the few stations that it is estimated from.

    χ² of normal errors, with the freedoms that the surface leaves: the stations less the four of a plane
    (less in the directions that they do not span), and no fewer than one.
    """
    from scipy.stats import chi2

    offset = stations.place - stations.place.mean(axis=0)
    spanned = int(np.linalg.matrix_rank(offset, tol=1e-6 * max(stations.extent, 1e-12)))
    freedoms = max(len(offset) - 1 - spanned, 1)
    low, high = np.sqrt(freedoms / chi2.ppf([(1 + level) / 2, (1 - level) / 2], freedoms))
    error = leave_one_out(stations)
    return np.stack([low * error, high * error])


def beyond_hull(points: Array, place: Array) -> float:
    """Distance of ``place`` (3,) from the convex hull of ``points`` (n, 3); zero inside.

    The nearest point of the hull is the mix of points with weights of at least zero and sum one (non-negative
    least squares, the sum as a row that weighs a thousand times more), whatever dimension they span.
    """
    from scipy.optimize import nnls

    offset = points - place
    heavy = 1e3 * max(float(np.abs(offset).max()), 1e-12)
    weights, _ = nnls(np.vstack([offset.T, np.full(len(points), heavy)]), np.array([0.0, 0.0, 0.0, heavy]))
    return float(np.linalg.norm(offset.T @ weights / weights.sum()))


def _interpolated(known: Array, values: Array, places: Array, method: str) -> Array:
    """Values (m, d) at ``places`` (m, 3), from those (n, d) at ``known`` (n, 3), by the method chosen."""
    from scipy.interpolate import RBFInterpolator

    if method == SPLINE:
        return np.asarray(RBFInterpolator(known, values, kernel="thin_plate_spline")(places))
    middle = known.mean(axis=0)
    gradient, *_ = np.linalg.lstsq(known - middle, values - values.mean(axis=0), rcond=1e-6)
    return np.asarray(values.mean(axis=0) + (places - middle) @ gradient)
