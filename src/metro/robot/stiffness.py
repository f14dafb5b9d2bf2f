"""Joint compliances from static load tests: linear least squares, with positivity kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array


@dataclass(frozen=True, eq=False)
class Compliances:
    """The compliances of the joints, estimated from load tests.

    Attributes
    ----------
    value : (n,) rad/(N m), none negative; 0 for a joint that the tests do not see.
    covariance : (n, n); infinite variance, no covariance, for a joint that the tests do not see.
    seen : (n,) whether the tests distinguish this joint from the others at all.
    scatter : standard deviation of a displacement about the fit, m (where errors differ: of one of relative
        size one); ``dof`` its degrees of freedom.
    """

    value: Array
    covariance: Array
    seen: np.ndarray
    scatter: float
    dof: int

    @property
    def sd(self) -> Array:
        """Standard errors (n,), rad/(N m)."""
        return np.sqrt(np.diag(self.covariance))


def joint_compliances(
    contributions: Array, displacement: Array, relative: Array | float = 1.0
) -> Compliances:
    """Fit joint compliances to displacements of the tip under known forces.

    Parameters
    ----------
    contributions : (m, 3, n) of :func:`metro.robot.statics.joint_contributions`, one per load.
    displacement : (m, 3) m, NaN where a component was not measured.
    relative : (m, 1) or (m, 3), size of the error of each displacement relative to the others'.

    Raises
    ------
    ValueError
        If the measured components are too few to identify any joint, or there are none.
    """
    from scipy.optimize import nnls

    measured = np.isfinite(displacement)
    weight = 1.0 / np.broadcast_to(relative, measured.shape)[measured]
    design, target = contributions[measured] * weight[:, None], displacement[measured] * weight
    joints = design.shape[1]
    seen = distinguishable(design)
    dof = len(target) - int(seen.sum())
    if dof < 1 or not seen.any():
        raise ValueError(f"{len(target)} measured displacements cannot separate the joints")
    size = np.linalg.norm(design[:, seen], axis=0)
    scaled = design[:, seen] / size
    if not (np.isfinite(scaled).all() and np.isfinite(target).all()):
        raise ValueError("found loads or displacements that are not finite")
    try:
        solution, residual = nnls(scaled, target)
    except RuntimeError as error:
        raise ValueError(f"the joint compliances were not found: {error}") from error
    scatter = float(residual / np.sqrt(dof))
    value, covariance = np.zeros(joints), np.diag(np.full(joints, np.inf))
    value[seen] = solution / size
    covariance[np.ix_(seen, seen)] = scatter**2 * np.linalg.inv(scaled.T @ scaled) / np.outer(size, size)
    return Compliances(value, covariance, seen, scatter, dof)


def distinguishable(design: Array, least: float = 1e-3) -> np.ndarray:
    """Which columns (n,) of a design matrix (m, n) its rows distinguish from all others.

    A column is distinguishable when it is not zero (a joint whose axis passes every line of force) and when
    the part of it that no combination of the others makes is above ``least`` of it (a joint that always moves
    with another).
    """
    norms = np.linalg.norm(design, axis=0)
    present = norms > 1e-6 * norms.max(initial=0.0)
    seen: np.ndarray = present.copy()
    for i in np.flatnonzero(present):
        others = np.flatnonzero(present & (np.arange(len(norms)) != i))
        basis = design[:, others] / norms[others]
        own = design[:, i] - basis @ np.linalg.lstsq(basis, design[:, i], rcond=1e-10)[0]
        seen[i] = np.linalg.norm(own) > least * norms[i]
    return seen
