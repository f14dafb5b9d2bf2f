"""Parameters of a stylus profile by ISO 21920-2 (formerly ISO 4287): of heights, slope and spacing.

Of the whole trace they are P parameters, of its waviness W, of its roughness R parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array

LEAST_HEIGHT = 0.05  # of the total height: what stays lower than this is no profile element of its own
SLOPE = np.array([1.0, -9.0, 45.0, 0.0, -45.0, 9.0, -1.0]) / 60  # seven-point derivative, as a convolution


@dataclass(frozen=True)
class ProfileParameters:
    """Mean deviation ``a``, rms ``q``, skewness, kurtosis, total height ``t``; rms slope; mean element width.

    Lengths in the unit of the profile; ``width`` is NaN where the profile has not two elements.
    """

    a: float
    q: float
    skewness: float
    kurtosis: float
    t: float
    slope: float
    width: float


def profile_parameters(z: Array, spacing: float) -> ProfileParameters:
    """Return the parameters of an evenly spaced profile (n,) about its mean, ``spacing`` in the same unit.

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
    q = float(np.sqrt(np.mean(z**2)))
    slope = np.convolve(z, SLOPE, mode="valid") / spacing
    return ProfileParameters(
        a=float(np.abs(z).mean()),
        q=q,
        skewness=float(np.mean(z**3)) / q**3,
        kurtosis=float(np.mean(z**4)) / q**4,
        t=float(np.ptp(z)),
        slope=float(np.sqrt(np.mean(slope**2))),
        width=_element_width(z) * spacing,
    )


def _element_width(z: Array) -> float:
    """Mean distance, in points, of upward crossings between parts that are high or low enough to count."""
    begins = np.concatenate([[0], np.flatnonzero(np.diff(np.sign(z)) != 0) + 1])
    size = np.maximum.reduceat(np.abs(z), begins)
    begins = begins[size >= LEAST_HEIGHT * np.ptp(z)]
    side = np.sign(z[begins])
    # of neighbours on one side of the line, with only small ones between, the first begins the element
    first = np.append(True, side[1:] != side[:-1])
    up = begins[first & (side > 0)]
    up = up[up > 0]
    if len(up) < 2:
        return float("nan")
    crossings = up - 1 + z[up - 1] / (z[up - 1] - z[up])
    return float(np.diff(crossings).mean())
