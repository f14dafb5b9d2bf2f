"""Parameters of a stylus profile by ISO 21920-2 (formerly ISO 4287): of heights, slope and spacing.

Of the whole trace they are P parameters, of its waviness W, of its roughness R parameters.

A profile element is a hill and the dale behind it. What rises less than 5 % of the total height from the mean
line is neither, nor is what is narrower than 1 % of the section length (the default of ISO 4287 and of the
NPL software gauges: "±5 % of Pz, 1 % of the sampling length").
"""

from __future__ import annotations

from dataclasses import dataclass
from heapq import heapify, heappop, heappush

import numpy as np

from metro.units import Array

LEAST_HEIGHT = 0.05  # of the total height: what stays lower than this is no profile element of its own
LEAST_WIDTH = 0.01  # of the section length
SLOPE = np.array([1.0, -9.0, 45.0, 0.0, -45.0, 9.0, -1.0]) / 60  # seven-point derivative, as a convolution
# Section length by the mean width of the elements, m (ISO 4288, table 3; ISO 21920-3, table 2): up to this
# width, this length. The last holds for all that are wider.
SECTIONS = ((0.04e-3, 0.08e-3), (0.13e-3, 0.25e-3), (0.4e-3, 0.8e-3), (1.3e-3, 2.5e-3), (np.inf, 8e-3))


@dataclass(frozen=True)
class ProfileParameters:
    """Mean deviation ``a``, rms ``q``, skewness, kurtosis, total height ``t``; rms slope; mean element width.

    ``p`` and ``v``: highest peak and deepest valley from the mean line. Lengths in the unit of the profile;
    ``width`` is NaN where the profile has not two elements.
    """

    a: float
    q: float
    skewness: float
    kurtosis: float
    t: float
    slope: float
    width: float
    p: float
    v: float


@dataclass(frozen=True)
class Moments:
    """Mean deviation ``a``, rms ``q``, skewness and kurtosis of heights about their mean."""

    a: float
    q: float
    skewness: float
    kurtosis: float


def moments(z: Array) -> Moments:
    """Return the moments of heights (n,) about their mean, which are not all the same."""
    z = z - z.mean()
    square = z * z
    q = float(np.sqrt(square.mean()))
    return Moments(
        float(np.abs(z).mean()), q, float(square @ z) / len(z) / q**3, float(square @ square) / len(z) / q**4
    )


def slope(z: Array, spacing: float) -> float:
    """Return the rms slope of an evenly spaced profile (n,); NaN of fewer points than a slope takes."""
    if len(z) < len(SLOPE):
        return float("nan")
    return float(np.sqrt(np.mean((np.convolve(z, SLOPE, mode="valid") / spacing) ** 2)))


def profile_parameters(z: Array, spacing: float, narrowest: float = 0.0) -> ProfileParameters:
    """Return the parameters of an evenly spaced profile (n,) about its mean, ``spacing`` in the same unit.

    ``narrowest``: width below which a hill or a dale is not counted, in the same unit.

    Raises
    ------
    ValueError
        Where there are fewer than seven points, or all are of one height.
    """
    if len(z) < len(SLOPE) or not np.ptp(z):
        raise ValueError(
            f"a profile of {len(z)} points between {z.min():g} and {z.max():g} has no parameters"
        )
    z = z - z.mean()
    of_heights = moments(z)
    widths = np.diff(upward_crossings(z, narrowest / spacing)) * spacing
    return ProfileParameters(
        **vars(of_heights),
        t=float(np.ptp(z)),
        slope=slope(z, spacing),
        width=float(widths.mean()) if len(widths) else float("nan"),
        p=float(z.max()),
        v=float(-z.min()),
    )


def section_length(z: Array, spacing: float) -> float:
    """Return the section length, m, that belongs to the mean width of a profile's elements, z (n,) in m."""
    widths = np.diff(upward_crossings(z - z.mean(), 0.0)) * spacing
    width = float(widths.mean()) if len(widths) else np.inf
    return next(length for most, length in SECTIONS if width <= most)


def upward_crossings(z: Array, narrowest: float) -> Array:
    """Return the places, in points, at which elements of a profile (n,) about its mean line begin.

    Parameters
    ----------
    narrowest : in points. Narrower hills and dales are joined to their neighbours, the narrowest first. The
        first and the last, which the ends of the profile cut off, are kept: their widths are not known.
    """
    begins = np.concatenate([[0], np.flatnonzero(np.diff(np.sign(z)) != 0) + 1])
    size = np.maximum.reduceat(np.abs(z), begins)
    begins = begins[size >= LEAST_HEIGHT * np.ptp(z)]
    side = np.sign(z[begins])
    # of neighbours on one side of the line, with only small ones between, the first begins the element
    begins = begins[np.append(True, side[1:] != side[:-1])]
    begins = _without_narrow(begins, narrowest)
    up = begins[(z[begins] > 0) & (begins > 0)]
    return np.asarray(up - 1 + z[up - 1] / (z[up - 1] - z[up]))


def _without_narrow(begins: np.ndarray, narrowest: float) -> np.ndarray:
    """Return the beginnings (k,) of alternate hills and dales without the narrow ones, narrowest first.

    Without one, the next is on the side of the one before, and goes on with it.
    """
    count, at = len(begins), begins.tolist()  # single elements of arrays take longer
    before, behind, there = list(range(-1, count - 1)), list(range(1, count + 1)), [True] * count
    queue = [(at[i + 1] - at[i], i) for i in range(1, count - 1) if at[i + 1] - at[i] < narrowest]
    heapify(queue)
    while queue:
        width, i = heappop(queue)
        if not there[i] or before[i] < 0 or behind[i] >= count or at[behind[i]] - at[i] != width:
            continue  # it is gone, or another one was joined to it
        last, joined, following = before[i], behind[i], behind[behind[i]]
        there[i] = there[joined] = False
        behind[last] = following
        if following < count:
            before[following] = last
            if before[last] >= 0 and at[following] - at[last] < narrowest:
                heappush(queue, (at[following] - at[last], last))
    return np.asarray(begins[np.array(there, dtype=bool)])
