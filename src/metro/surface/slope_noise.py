"""How well slopes are read, by what the closed loops leave, and which readings contradict the others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.surface.slopes import Levelled
from metro.units import Array

CONTRADICTED = 0.025  # probability of a scatter this large or larger, below which a declared one is not taken
WRONG = 0.05  # probability of the largest residual among all, below which a reading is named
LEAST_SHARE = 1e-6  # of an error that shows in a residual: a reading with less is in no closed loop
ALIKE = 0.99  # of the largest residual: readings that deviate as much as that cannot be distinguished


@dataclass(frozen=True)
class SlopeNoise:
    """Standard deviation of a reading, rad, its degrees of freedom (inf: known), and what it is from.

    ``sigma`` is NaN and ``source`` "" where nothing determines it.
    """

    sigma: float
    dof: float
    source: str


def slope_noise(found: Levelled, slope: Array, declared: float) -> SlopeNoise:
    """Return the noise of readings (n,), rad; ``declared`` is NaN where no standard deviation is stated.

    A declared one is taken unless the loops close worse than it allows. Readings are rounded, so that no
    scatter is less than that of a rectangle as wide as the last digit.
    """
    from scipy.stats import chi2

    scatter, dof = found.scatter, found.dof
    if np.isfinite(declared):
        allowed = not dof or chi2.sf(dof * scatter**2 / max(declared**2, 1e-30), dof) >= CONTRADICTED
        if allowed:
            return SlopeNoise(declared, np.inf, "declared standard deviation")
    if not dof:
        return SlopeNoise(np.nan, np.inf, "")
    if scatter < _rounding(slope):
        return SlopeNoise(_rounding(slope), np.inf, "last digit of the readings")
    return SlopeNoise(scatter, dof, "closure of the loops")


def suspects(found: Levelled) -> tuple[np.ndarray, float]:
    """Return which readings may be the one that is wrong, and the probability of that by chance.

    Each residual is held against the scatter of the others (externally studentised, Bonferroni over all). Of
    several whose errors show alike, each may be it. None, and 1, where the loops close as they should.
    """
    from scipy.stats import t

    nobody = np.empty(0, dtype=np.intp), 1.0
    looked = np.flatnonzero(found.redundancy > LEAST_SHARE)
    if found.dof < 2 or not len(looked) or not found.scatter:
        return nobody
    square = found.residuals[looked] ** 2 / found.redundancy[looked]
    rest = found.residuals @ found.residuals - square
    scaled = np.sqrt(square / np.maximum(rest, 1e-12 * square) * (found.dof - 1))
    chance = min(1.0, len(looked) * 2.0 * float(t.sf(scaled.max(), found.dof - 1)))
    return (looked[scaled >= ALIKE * scaled.max()], chance) if chance < WRONG else nobody


def _rounding(slope: Array) -> float:
    """Return the standard deviation that rounding adds to readings, by the least step between them."""
    steps = np.diff(np.unique(slope))
    steps = steps[steps > 1e-9 * max(float(np.abs(slope).max()), np.finfo(float).tiny)]
    return float(steps.min()) / np.sqrt(12.0) if len(steps) else 0.0
