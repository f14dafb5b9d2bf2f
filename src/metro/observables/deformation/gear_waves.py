"""What the gears of an arm leave on walls whatever the force: waves of the joint angles, which walls share.

A gear's output is ahead of its motor by an error that repeats with the turns of the joint and of the motor.
Walls along one path show the same error, and walls elsewhere show what their joint angles have in common.
Of each joint it is a sum of waves of random phases: once and twice per turn of the joint, and of the motor,
whose turns per turn of the joint are declared or lie in the usual range. The leading principal components of
that sum over all walls (Karhunen-Loève) are unknowns of the model, believed to be as large as they are.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from metro.surface.profile import gaussian_filter
from metro.units import ARCSEC, UM, Array

LEAST, MOST = 2.0 * ARCSEC, 30.0 * ARCSEC  # of the error of a gear of an arm, peak to peak
PER_TURN = (1, 2)  # waves per turn of the joint, and of the motor
RATIOS = (50.0, 200.0)  # turns of the motor per turn of the joint, where they are not declared
LEFT = 2.0 * UM  # rms on the walls of what the components leave out: below the error of a stylus trace


@dataclass(frozen=True, eq=False)
class Path:
    """Where the joints were along a wall that was traced.

    Attributes
    ----------
    angles : (m, n) of the joints that turn, rad. outwards : (m, n) m/rad, how far a turn of each moves the
        tip out of the wall. kept : (k,) the points that are compared.
    spacing, cutoff : of the points and of the profile's filter, m.
    """

    angles: Array
    outwards: Array
    kept: np.ndarray
    spacing: float
    cutoff: float


def mean_square() -> float:
    """Return the mean square of the error of a gear, rad²: log-uniform peak to peak, and a sine."""
    return (MOST**2 - LEAST**2) / (2.0 * math.log(MOST / LEAST)) / 8.0


def principal_waves(walls: Sequence[Path], ratios: Array | None = None) -> list[Array]:
    """Return the heights of the principal components on each wall, (k, c) m per standard deviation.

    Parameters
    ----------
    ratios : (n,) turns of the motors per turn of their joints; None where they are not declared.

    Returns
    -------
    list of Array
        with the same c for all walls, greatest component first.
    """
    # Two walls at a time: all points of all walls together would be gigabytes for walls of some metres.
    covariance = np.block([[_covariance(one, other, ratios) for other in walls] for one in walls])
    square, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    square, vectors = np.maximum(square[::-1], 0.0), vectors[:, ::-1]
    left = np.append(np.cumsum(square[::-1])[::-1], 0.0)
    components = (vectors * np.sqrt(square))[:, : int(np.argmax(left < len(square) * LEFT**2))]
    return np.split(components, np.cumsum([len(wall.kept) for wall in walls])[:-1])


def _covariance(one: Path, other: Path, ratios: Array | None) -> Array:
    """Covariance (k, l) of the heights of two walls as profiles show them, m².

    The work is touched in the middle of a wall, where its height is zero.
    """
    total = np.zeros((len(one.angles), len(other.angles)))
    for joint in range(one.angles.shape[1]):
        lag = one.angles[:, joint, None] - other.angles[:, joint]
        each = _correlation(lag, None if ratios is None else float(ratios[joint]))
        each = each - each[len(each) // 2]
        each = each - each[:, [each.shape[1] // 2]]
        total += np.outer(one.outwards[:, joint], other.outwards[:, joint]) * each
    return np.asarray(mean_square() * _filtered(_filtered(total, one).T, other).T)


def _correlation(lag: Array, ratio: float | None) -> Array:
    """Correlation of a gear's error at angles of a joint that are ``lag`` apart, rad.

    All waves have the same share. Where the ratio is not declared it is uniform over the usual range, whose
    mean of cos(N lag) is that of its middle times a sinc.
    """
    middle, half = (ratio, 0.0) if ratio is not None else (sum(RATIOS) / 2.0, (RATIOS[1] - RATIOS[0]) / 2.0)
    of_joint = [np.cos(order * lag) for order in PER_TURN]
    of_motor = [np.cos(order * middle * lag) * np.sinc(order * half * lag / math.pi) for order in PER_TURN]
    return np.asarray(np.mean([*of_joint, *of_motor], axis=0))


def _filtered(heights: Array, wall: Path) -> Array:
    """Pass columns over the points of a wall through its profile's filter, and keep what is compared."""
    return np.asarray(gaussian_filter(heights, wall.spacing, wall.cutoff)[wall.kept])
