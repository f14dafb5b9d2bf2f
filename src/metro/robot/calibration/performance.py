"""Accuracy and repeatability of poses that were taken several times, as ISO 9283 defines them.

AP: distance of the barycentre of the attained positions from the expected one. RP: mean distance from the
barycentre plus three standard deviations of these distances. vAP: largest distance between barycentres of the
same pose by the directions from which the joints came.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.robot.calibration.fit import Fit
from metro.robot.calibration.poses import Poses
from metro.units import Array

FEWEST = 5  # repeats of a pose; ISO 9283 asks for 30


@dataclass(frozen=True, eq=False)
class Repeated:
    """A pose that was taken several times, lengths in m.

    Attributes
    ----------
    target : its number. count : of the repeats.
    accuracy : AP of each fit; ``accuracy_sd``: standard deviation of a coordinate of the barycentre.
    repeatability : RP with its 95 % interval. directional : vAP; NaN where all came from one direction.
    """

    target: int
    count: int
    accuracy: tuple[float, ...]
    accuracy_sd: float
    repeatability: tuple[float, float, float]
    directional: float


def repeated(poses: Poses, target: Array, fits: tuple[Fit, ...]) -> tuple[Repeated, ...]:
    """Return the figures of each pose that was taken :data:`FEWEST` times or more.

    ``target``: (m,) number of the commanded pose; NaN where it has none. Distances have none of them.
    """
    found: list[Repeated] = []
    if poses.by_distance:
        return ()
    for number in np.unique(target[np.isfinite(target)]):
        own = poses.of(target == number)
        if len(own) >= FEWEST:
            errors = tuple(own.at - fit.predicted(own) for fit in fits)
            found.append(_figures(int(number), own, errors))
    return tuple(found)


def spread(poses: Poses, target: Array) -> tuple[float, int]:
    """Return the standard deviation of a coordinate or distance among repeats, m, and its degrees of freedom.

    Repeats that came from the same directions, seen from the same station; (0, 0) without any.
    """
    square, freedom = 0.0, 0
    for number in np.unique(target[np.isfinite(target)]):
        own = poses.of(target == number)
        values = own.distance[:, None] if own.by_distance else own.at
        alike = np.column_stack([own.came, own.station])
        ways = np.unique(alike, axis=0, return_inverse=True)[1].ravel()
        for way in np.unique(ways):
            at = values[ways == way]
            square += float(np.sum((at - at.mean(axis=0)) ** 2))
            freedom += at.shape[1] * (len(at) - 1)
    return (float(np.sqrt(square / freedom)), freedom) if freedom else (0.0, 0)


def _figures(number: int, own: Poses, errors: tuple[Array, ...]) -> Repeated:
    apart_by = own.at - own.at.mean(axis=0)
    freedom = 3 * (len(own) - 1)
    sd = float(np.sqrt(np.sum(apart_by**2) / freedom))
    accuracy = tuple(float(np.linalg.norm(each.mean(axis=0))) for each in errors)
    ways = np.unique(own.came, axis=0, return_inverse=True)[1].ravel()
    centres = np.array([own.at[ways == way].mean(axis=0) for way in np.unique(ways)])
    apart = np.linalg.norm(centres[:, None] - centres, axis=2)
    directional = float(apart.max()) if len(centres) > 1 else float("nan")
    return Repeated(number, len(own), accuracy, sd / np.sqrt(len(own)), _rp(apart_by, freedom), directional)


def _rp(apart_by: Array, freedom: int) -> tuple[float, float, float]:
    """Return RP, and its interval by chi-squared: that of the spread of a coordinate, alike in all axes."""
    from scipy.stats import chi2

    distances = np.linalg.norm(apart_by, axis=1)
    rp = float(distances.mean() + 3.0 * distances.std(ddof=1))
    low, high = (float(np.sqrt(freedom / chi2.ppf(p, freedom))) for p in (0.975, 0.025))
    return rp, rp * low, rp * high
