"""How uncertain the lobes are: the boundary under deviations of the modes and of the cutting coefficients.

Every crossing near the lowest is followed to first order in the logarithms of the parameters; the lowest is
taken sample by sample, so that a lobe may give way to its neighbour.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from metro.dynamics import crossings
from metro.dynamics.crossings import Candidates
from metro.dynamics.lobes import Boundary, fine_kernel, groups
from metro.dynamics.system import Cut, Structure
from metro.units import Array

_STEP = 1e-4
_LIMIT = 0.5  # of a shift in log depth: beyond it, and near a fold, first order does not hold


def depth_samples(structure: Structure, cut: Cut, boundary: Boundary, deviations: Array) -> Array:
    """Lowest depths (s, k) in metres for s samples of the parameters.

    Parameters
    ----------
    boundary : of ``structure`` and ``cut`` at k speeds.
    deviations : (s, 3 m + 2) deviations of the natural logarithms of the m frequencies, m damping ratios,
        m stiffnesses, ktc and krc.
    """
    depths = np.full((len(deviations), len(boundary.rpm)), np.inf)
    for group in groups(structure, cut, boundary.rpm):
        place = np.full(len(boundary.rpm), -1)
        place[group] = np.arange(len(group))
        mine = boundary.crossings.take(place[boundary.crossings.speed] >= 0)
        local = replace(mine, speed=place[mine.speed])
        slopes = _log_slopes(structure, cut, boundary.rpm[group], local)
        values = -np.log(mine.inverse) - np.clip(deviations @ slopes.T, -_LIMIT, _LIMIT)
        for j in range(len(mine.speed)):
            column = depths[:, mine.speed[j]]
            np.minimum(column, np.exp(values[:, j]), out=column)
    return depths


def _log_slopes(structure: Structure, cut: Cut, rpm: Array, at: Candidates) -> Array:
    """(c, 3 m + 2) derivatives of log(1/depth) of each crossing by the logarithms of the parameters."""
    base = np.log(_followed(structure, cut, rpm, at))
    columns = [np.log(_followed(*changed, rpm, at)) - base for changed in _perturbed(structure, cut)]
    slopes = np.stack(columns, axis=1) / _STEP
    return np.where(np.isfinite(slopes), slopes, 0.0)


def _followed(structure: Structure, cut: Cut, rpm: Array, at: Candidates) -> Array:
    refined = crossings.refine(fine_kernel(structure, cut, rpm), at, 2)
    return np.where(refined.converged, refined.at.inverse, np.nan)


def _perturbed(structure: Structure, cut: Cut) -> Iterator[tuple[Structure, Cut]]:
    for name in ("omega", "zeta", "stiffness"):
        for mode in range(len(structure.omega)):
            values = getattr(structure, name).copy()
            values[mode] *= np.exp(_STEP)
            yield replace(structure, **{name: values}), cut
    yield structure, replace(cut, ktc=cut.ktc * np.exp(_STEP))
    yield structure, replace(cut, krc=cut.krc * np.exp(_STEP))
