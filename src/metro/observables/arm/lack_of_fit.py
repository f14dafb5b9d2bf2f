"""How far an arm is from one of elastic joints: what its load tests show beside the joints, pose by pose.

Links that bend, a base that tilts and bearings make the tip give way, too. As long as all that is elastic,
the tip has one compliance matrix in each pose, which no load test contradicts but which the joints do not
make. The residual about the joints is therefore split into what is linear in the force in each pose, which is
their lack of fit, and the rest, which scatters (Draper and Smith, Applied Regression Analysis, 3rd ed., 2.1).
The lack of fit is another in another pose or direction: it is an error of whatever is predicted from these
joints.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from metro.units import Array

SAME_DIRECTION = 1e-3  # of the largest force: smaller components of a load are not meant


@dataclass(frozen=True)
class LackOfFit:
    """What load tests show beside elastic joints.

    ``share``: rms of what is linear in the force, relative to the displacement. ``scatter``: standard
    deviation of the rest, of a displacement of relative error one, m.
    """

    share: float
    scatter: float


def lack_of_fit(
    poses: Sequence[np.ndarray], force: Array, residual: Array, moved: Array, unknowns: int
) -> LackOfFit:
    """Split the residual of load tests about elastic joints.

    Where no pose has more loads than its compliance has unknowns, all of the residual counts as both: nothing
    shows which it is.

    Parameters
    ----------
    poses : indices of the tests in each pose.
    force : (m, 3) N. residual, moved : (m, 3), over the relative error of each; NaN where not measured.
    unknowns : number of joints that were fitted to these tests.
    """
    about_joints, about_poses, free = 0.0, 0.0, 0
    for tests in poses:
        for axis in range(3):
            measured = tests[np.isfinite(residual[tests, axis])]
            left, rank = _beyond_linear(force[measured], residual[measured, axis])
            about_joints += float(residual[measured, axis] @ residual[measured, axis])
            about_poses, free = about_poses + left, free + rank
    known = np.isfinite(residual)
    count, size = int(known.sum()), float(np.mean(moved[known] ** 2))
    whole = about_joints / max(count - unknowns, 1)
    if count <= free or free <= unknowns:
        return LackOfFit(math.sqrt(whole / size), math.sqrt(whole))
    scatter = about_poses / (count - free)
    linear = max(0.0, (about_joints - about_poses) / (free - unknowns) - scatter)
    return LackOfFit(math.sqrt(linear * free / count / size), math.sqrt(scatter))


def _beyond_linear(force: Array, residual: Array) -> tuple[float, int]:
    """Sum of squares of a residual (m,) that is not linear in the forces (m, 3), and the rank of these."""
    along, size, _ = np.linalg.svd(force, full_matrices=False)
    along = along[:, size > SAME_DIRECTION * size.max(initial=1e-300)]
    linear = along.T @ residual
    left = float(residual @ residual) - float(linear @ linear)
    return max(0.0, left), along.shape[1]


def directions(force: Array, measured: np.ndarray, per_newton: float) -> Array:
    """Errors that a compliance of the tip makes in the tests of one pose, (n, 9) m, each of one deviation.

    Parameters
    ----------
    force : (m, 3) N. measured : (m, 3), which displacements there are.
    per_newton : standard deviation of an entry of the compliance, m/N.
    """
    axis = np.nonzero(measured)[1]
    rows = np.repeat(force[:, None, :], 3, axis=1)[measured]
    result = np.zeros((len(axis), 3, 3))
    result[np.arange(len(axis)), axis] = per_newton * rows
    return result.reshape(len(axis), 9)
