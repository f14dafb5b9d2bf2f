"""How well the runs determine the parameters: what happens to them when one run is left out.

The weights of the fit hold a declared model-form budget, so the inverse of its normal matrix says how far the
parameters may deviate if the model were that wrong. Their random errors show between the runs: the
elements of a run share its coefficients, its phase and its zero, the runs share nothing. Without run i the
parameters move by (N − A_i)⁻¹ s_i, with N the normal matrix, A_i the run's part in it and s_i the run's
score. The sum of the squares of these moves is the cluster-robust variance CR3; the degrees of freedom of a
parameter are Satterthwaite's for that sum (Bell & McCaffrey 2002, Survey Methodology 28), so a parameter that
few runs determine has a wide interval however many runs there are.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from metro.loop.fitting.system import System, inverse, normal_equations
from metro.units import Array

ENOUGH = 2.0  # degrees of freedom from which the runs say how large the error of a parameter is


def between_runs(system: System) -> Array:
    """Deviation that the runs show over that of the normal matrix, of base and effect parameters, (p + q,).

    It is stated for Student's t with one degree of freedom less than there are runs, by which intervals are
    written. A parameter with less than ``ENOUGH`` degrees of freedom (one or two runs determine it) keeps the
    deviation of the normal matrix: its factor is one.
    """
    parts = [_part(system, run) for run in range(len(system.rows))]
    normals, scores = (np.array(each) for each in zip(*parts, strict=True))
    total, _ = normal_equations(system)
    whole = inverse(total)
    without = np.array([inverse(total - normal) for normal in normals])
    determined = np.isfinite(np.diagonal(without, axis1=1, axis2=2)).all(axis=0)
    whole, without = (np.where(np.isfinite(matrix), matrix, 0.0) for matrix in (whole, without))
    dof = _degrees_of_freedom(whole, without, normals)
    determined &= dof >= ENOUGH
    moves = np.einsum("ick,ik->ic", without, scores)
    ratio = (moves[:, determined] ** 2).sum(axis=0) / np.diag(whole)[determined]
    factor = np.ones(len(total))
    factor[determined] = np.sqrt(ratio) * _widening(dof[determined], len(parts) - 1)
    return factor


def wider_than(alike: Array, differing: Array) -> Array:
    """Return how much a deviation is larger (q,), at least one, by the larger one of two variances."""
    known = (alike > 0.0) & np.isfinite(alike) & np.isfinite(differing)
    return np.sqrt(np.maximum(np.divide(differing, alike, out=np.ones_like(alike), where=known), 1.0))


def _part(system: System, run: int) -> tuple[Array, Array]:
    """One run's part in the normal matrix and its score, without the prior of the effects."""
    return normal_equations(replace(system, rows=[system.rows[run]], weight=np.zeros_like(system.weight)))


def _degrees_of_freedom(whole: Array, without: Array, normals: Array) -> Array:
    """Satterthwaite's degrees of freedom of each parameter's sum of squared moves, (p + q,).

    If the weights are right, the moves i and j of a parameter covary by δ_ij b_iᵀu_i − u_iᵀ N⁻¹ u_j, with b_i
    the parameter's column of (N − A_i)⁻¹ and u_i = A_i b_i. The degrees are tr(C)²/tr(C²) of that matrix C.
    """
    pulled = normals @ without
    own = np.einsum("ikc,ikc->ci", without, pulled)
    each = np.moveaxis(pulled, 2, 0)  # of each parameter, u_i in rows
    between = each @ whole @ np.swapaxes(each, 1, 2)
    fitted = np.diagonal(between, axis1=1, axis2=2)
    trace = (own - fitted).sum(axis=1)
    square = (own**2 - 2.0 * own * fitted).sum(axis=1) + (between**2).sum(axis=(1, 2))
    return np.asarray(np.divide(trace**2, square, out=np.zeros_like(trace), where=square > 0.0))


def _widening(dof: Array, stated: float) -> Array:
    """Quantile of Student's t for 95 % with ``dof`` over that with the ``stated`` degrees of freedom."""
    from scipy.stats import t

    return np.asarray(t.ppf(0.975, dof) / t.ppf(0.975, stated))
