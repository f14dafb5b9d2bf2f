"""What noise does to the indices of a filtered face: each corrected, with its 95 % interval.

The estimate of the surface is disturbed again as it was disturbed by the scan's noise (parametric bootstrap),
and the indices are read of that. A mean square grows by that of the disturbance, whatever the surface, so
that indices which are means are corrected in their squares. An extreme grows the more, the more places are
nearly as high as the highest; the scan's noise has broken these ties, and a disturbance of the estimate grows
it too little. The upper end of the interval therefore takes the growth from the estimate as it is, the lower
one from the estimate with all places level that may be the highest, or the lowest (intersection bounds:
Chernozhukov, Lee & Rosen 2013, Econometrica 81; Hall & Miller 2010, Biometrika 97).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, islice

import numpy as np

from metro.surface.areal import CellSums
from metro.surface.denoise import Modes, field, finer
from metro.surface.indices import Index, iso_indices, lowered, raw_indices
from metro.surface.minimum_zone import vertical_zone
from metro.units import Array

PAIRS = 16
FIRST = 8  # disturbances from which their reach is estimated
ZONES = 12  # disturbances of which the minimum zone is read
MEANS = ("xa", "xg", "fltq")


def corrected(
    readings: dict[str, float], modes: Modes, *, sums: CellSums, inside: np.ndarray, nesting_index: float
) -> dict[str, Index]:
    """Return the indices as read, corrected, and with their intervals.

    Parameters
    ----------
    readings : of the scan as it is, by name; ``modes``, ``sums`` of the same, and the crop ``inside``.
    """
    passes = modes.through(nesting_index)
    level, level_finer = _Levelled(inside), _Levelled(inside.repeat(2, axis=0).repeat(2, axis=1))
    surface_estimate = modes.estimate(modes.scanned)

    def fields(each: Array) -> tuple[Array, Array]:
        return level(field(each)), level(field(each * passes))

    middle = fields(surface_estimate.modes)
    disturbed = (fields(each) for each in _errors(modes))
    first = list(islice(disturbed, FIRST))
    reach = [np.mean([np.abs(each[part]).max() for each in first]) for part in (0, 1)]
    tied = tuple(_tied(part, float(far)) for part, far in zip(middle, reach, strict=True))
    zone = _Zone(sums.grid.centres()[inside.ravel()])
    start = [_read(each, zone) for each in (middle, tied)]
    drawn: tuple[list[dict[str, float]], ...] = ([], [])
    for number, error in enumerate(chain(first, disturbed)):
        for draws, surface in zip(drawn, (middle, tied), strict=True):
            moved = tuple(part + off for part, off in zip(surface, error, strict=True))
            draws.append(_read(moved, zone if number < ZONES else None))
    per_cell = float(sums.count[inside].mean())
    estimate = start[0] | raw_indices(level_finer(finer(surface_estimate.modes, per_cell)), 0.0)
    indices = {}
    for name, value in readings.items():
        plain, level_draws = (np.array([draw[name] for draw in each if name in draw]) for each in drawn)
        if name in MEANS:
            ends = _of_mean(estimate[name], plain**2 - start[0][name] ** 2)
        else:
            ends = _of_extreme(estimate[name], plain - start[0][name], level_draws - start[1][name])
        indices[name] = lowered(value, *ends)
    return indices


def _of_mean(value: float, growth: Array) -> tuple[float, float, float]:
    """Return corrected value and ends of its interval by the growth (k,) of its square, in mirrored pairs."""
    square = value**2 - growth.mean() + _reach(growth, len(growth) // 2 - 1) * np.array([0.0, -1.0, 1.0])
    middle, low, high = np.sqrt(np.maximum(square, 0.0))
    return float(middle), float(low), float(high)


def _of_extreme(value: float, plain: Array, tied: Array) -> tuple[float, float, float]:
    """Return corrected value and ends by the growth (k,) of the estimate, and of it with its ties."""
    low = max(0.0, value - float(tied.mean() + _reach(tied, len(tied) - 1)))
    high = max(0.0, value - float(plain.mean() - _reach(plain, len(plain) - 1)))
    middle = value - float(plain.mean() + tied.mean()) / 2
    return min(max(middle, low), high), low, high


def _reach(draws: Array, freedom: int) -> float:
    """Return how far from the mean of some draws (k,) the next is in 19 of 20 times: Student."""
    from scipy.special import stdtrit

    number = len(draws)
    return float(stdtrit(freedom, 0.975) * np.sqrt(1 + 1 / number) * draws.std(ddof=1))


def _tied(surface: Array, reach: float) -> Array:
    """Cut ``surface`` (c,) at ``reach`` from its extremes; at the middle, where that is all of it."""
    low, high = float(surface.min()) + reach, float(surface.max()) - reach
    if low > high:
        low = high = (low + high) / 2
    return np.clip(surface, low, high)


def _errors(modes: Modes) -> Iterator[Array]:
    """Yield the modes of possible errors of the estimate, in mirrored pairs."""
    # The seed depends on the face, so that the error of few draws is not the same for all faces.
    random = np.random.default_rng(np.signbit(modes.scanned[:8, :8]).ravel().astype(int))
    estimate, sd = modes.estimate(modes.scanned), np.sqrt(modes.noise)
    for _ in range(PAIRS):
        off = modes.drawn(estimate, random)
        noise = sd * random.standard_normal(sd.shape, dtype=np.float32)
        louder = modes.doubt * np.float32(random.standard_normal())
        for sign in (1, -1):
            surface = estimate.modes + sign * off
            scale = np.sqrt(np.maximum(1 + sign * louder, np.float32(0.05)))
            yield modes.estimate(surface + sign * scale * noise).modes - surface


def _read(surface: tuple[Array, ...], zone: _Zone | None) -> dict[str, float]:
    """Read the indices of a surface, unfiltered and filtered, about their planes."""
    raw, filtered = surface
    indices = raw_indices(raw, 0.0) | iso_indices(filtered)
    return indices | {"minimum_zone": zone(filtered)} if zone is not None else indices


class _Levelled:
    """Take a field's values within a mask, less their least-squares plane."""

    def __init__(self, inside: np.ndarray) -> None:
        self.inside = inside
        basis = np.stack([np.ones(inside.shape), *np.indices(inside.shape)], axis=-1)[inside]
        self.basis = np.linalg.qr(basis)[0].astype(np.float32)

    def __call__(self, field: Array) -> Array:
        values = field[self.inside]
        return np.asarray(values - self.basis @ (self.basis.T @ values))


class _Zone:
    """Width of the minimum zone of heights over the same places; begins with the points that touched last."""

    def __init__(self, places: Array) -> None:
        centred = places - places.mean(axis=0)
        self.places = centred / np.abs(centred).max()
        self.touching = np.empty(0, dtype=np.intp)

    def __call__(self, heights: Array) -> float:
        half = float(np.ptp(heights)) / 2
        if not half:
            return 0.0
        width, working = vertical_zone(np.column_stack([self.places, heights / half]), self.touching)
        if not len(self.touching):
            self.touching = working
        return width * half
