"""How uncertain the lobes are: the boundary under deviations of the modes and of the cutting coefficients.

Every crossing near the lowest is followed to first order in the logarithms of the parameters; the lowest is
taken sample by sample, so that a lobe may give way to its neighbour.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from metro.dynamics import crossings
from metro.dynamics.collocation import Kernel, kernel
from metro.dynamics.crossings import Candidates
from metro.dynamics.lobes import Boundary, finely_discretised, groups
from metro.dynamics.system import Cut, Structure
from metro.units import Array, ComplexArray

_STEP = 1e-6  # of a logarithm: a mode that turns by hundreds of radians in a period bends within 1e-4
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
    """(c, 3 m + 2) derivatives of log(1/depth) of each crossing by the logarithms of the parameters.

    By perturbation of the eigenvalue that is 1/depth, which has to stay real: the angle gives way. The matrix
    is a sum over the modes, so that a change of one mode costs what that mode alone does.
    """
    arc, equation = finely_discretised(structure, cut, rpm)
    here = crossings.refine(equation, at, 2)

    def value(part: Kernel) -> ComplexArray:
        image = crossings.applied(part.take(here.at.speed), here.at.theta, here.shape)
        share: ComplexArray = (here.left * image).sum(axis=1)
        return share

    columns = {}
    for mode in range(len(structure.omega)):
        alone = structure.mode(mode)
        base = value(kernel(alone, arc, equation.period))
        for name in ("omega", "zeta"):
            changed = replace(alone, **{name: getattr(alone, name) * np.exp(_STEP)})
            columns[name, mode] = (value(kernel(changed, arc, equation.period)) - base) / _STEP
        columns["stiffness", mode] = -base  # what a mode contributes is in proportion to its compliance
    whole = value(equation)
    for name in ("ktc", "krc"):
        other = replace(cut, **{name: getattr(cut, name) * np.exp(_STEP)})
        columns[name, 0] = (value(finely_discretised(structure, other, rpm)[1]) - whole) / _STEP
    ordered = [
        columns[name, mode] for name in ("omega", "zeta", "stiffness") for mode in range(len(structure.omega))
    ]
    change = np.stack([*ordered, columns["ktc", 0], columns["krc", 0]], axis=1)
    turn = -change.imag / np.where(here.rate.imag == 0.0, np.inf, here.rate.imag)[:, None]
    slopes = (change + here.rate[:, None] * turn).real / here.at.inverse[:, None]
    return np.where(here.converged[:, None] & np.isfinite(slopes), slopes, 0.0)
