"""By how much one profile lies further along than another that should be like it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import MM, Array

REACH, STEP = 2 * MM, 0.1 * MM
ITERATIONS = 8
LEAST_ALIKE = 0.6  # correlation that two profiles without anything in common do not reach at any shift


@dataclass(frozen=True)
class Shift:
    """A shift, m, positive where the first profile has the other's waves further along, and its error, m.

    ``alike``: correlation of the two with the shift. An infinite error: they are not alike at any shift.
    """

    value: float
    sd: float
    alike: float

    @property
    def detected(self) -> bool:
        """Whether the shift is significant: more than three of its errors from zero."""
        return abs(self.value) > 3.0 * self.sd


def shift_between(profile: Array, other: Array, kept: np.ndarray, spacing: float, besides: Array) -> Shift:
    """Shift s for which ``profile(x)`` is most like ``gain × other(x − s)``, to a fraction of a sample.

    Least squares in gain, shift and the amplitudes of ``besides`` (shapes that the profile may have besides,
    at places where they are confounded with a shift). The error allows for a residual correlated along the
    profile.

    Parameters
    ----------
    profile, other : (n,) evenly spaced. kept : (n,) bool, the points of ``profile`` that are compared.
    spacing : m. besides : (n, k).
    """
    from scipy.interpolate import CubicSpline

    x = spacing * np.arange(len(other))
    along = CubicSpline(x, other)
    place, target = x[kept], profile[kept]
    apart = _basis(np.column_stack([np.ones(len(target)), besides[kept]]))
    target = target - apart @ (apart.T @ target)

    def freed(values: Array) -> Array:
        return np.asarray(values - apart @ (apart.T @ values))

    tries = np.arange(-REACH, REACH + STEP / 2, STEP)
    alike = [_correlation(target, freed(along(place - s))) for s in tries]
    s = float(tries[int(np.argmax(alike))])
    for _ in range(ITERATIONS):
        columns = np.stack([freed(along(place - s)), -freed(along(place - s, 1))], axis=1)
        (gain, slope), *_ = np.linalg.lstsq(columns, target, rcond=None)
        s += float(np.clip(slope / gain if gain > 0.0 else 0.0, -STEP, STEP))
    columns = np.stack([freed(along(place - s)), -freed(along(place - s, 1))], axis=1)
    solution, *_ = np.linalg.lstsq(columns, target, rcond=None)
    residual = target - columns @ solution
    correlation = _correlation(target, columns[:, 0])
    if correlation < LEAST_ALIKE or abs(s) >= REACH:
        return Shift(0.0, np.inf, max(alike))
    variance = residual @ residual / len(residual) * _correlation_length(residual)
    covariance = variance * np.linalg.inv(columns.T @ columns)
    return Shift(s, float(np.sqrt(covariance[1, 1]) / solution[0]), correlation)


def _basis(columns: Array) -> Array:
    """Orthonormal basis of the columns; those that the others make are left out."""
    left, size, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(left[:, size > 1e-9 * size.max()])


def _correlation(first: Array, second: Array) -> float:
    size = float(np.linalg.norm(first) * np.linalg.norm(second))
    return float(first @ second) / size if size > 0.0 else 0.0


def _correlation_length(residual: Array) -> float:
    """How many neighbouring points are correlated: sum of the autocorrelation up to its first zero."""
    spectrum = np.abs(np.fft.rfft(residual, 2 * len(residual))) ** 2
    along = np.fft.irfft(spectrum)[: len(residual)]
    along = along / along[0] if along[0] > 0.0 else np.eye(1, len(residual))[0]
    end = int(np.argmax(along <= 0.0)) or len(along)
    return float(1.0 + 2.0 * along[1:end].sum())
