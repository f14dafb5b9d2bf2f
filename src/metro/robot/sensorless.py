"""The force on the tip, from what the motors carry in the cut beyond the idle run ([K] §3.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import Array

LEAST_INDEX = 2.0
LEAST_JOINTS = 3


@dataclass(frozen=True, eq=False)
class TipForce:
    """A force on the tip along the path.

    Attributes
    ----------
    force : (m, 3) N, frame of the Jacobian that was given.
    covariance : (m, 3, 3) N².
    condition : (m,) of the weighted system; the larger, the less one direction of the force rests on.
    """

    force: Array
    covariance: Array
    condition: Array


def observability(cutting: Array, idle: Array) -> Array:
    """Index PI = |mean τ_cutting| / (max τ_idle − min τ_idle) per joint, (n,) ([K] eq. 14).

    Parameters
    ----------
    cutting : (m, n) torque of the cut less that of the idle run, N m, over the stretch that is judged.
    idle : (m, n) torque of the idle run over the same stretch, N m.
    """
    return np.asarray(np.abs(cutting.mean(axis=0)) / np.ptp(idle, axis=0))


def tip_force(torque: Array, variance: Array, jacobian_at_tip: Array, index: Array) -> TipForce:
    """Solve τ = −Jᵀ f for the force, by weighted least squares over the joints that pass the index.

    Parameters
    ----------
    torque : (m, n) torque of the cut less that of the idle run, N m.
    variance : (m, n) its variance.
    jacobian_at_tip : (m, 3, n). index : (n,) of :func:`observability`.

    Raises
    ------
    ValueError
        If fewer than three joints pass.
    """
    use = index >= LEAST_INDEX
    if use.sum() < LEAST_JOINTS:
        raise ValueError(
            f"only {int(use.sum())} of {len(index)} joints reach the observability index {LEAST_INDEX:g}; "
            f"at least {LEAST_JOINTS} are needed"
        )
    weight = 1 / np.sqrt(variance[:, use])
    system = -np.swapaxes(jacobian_at_tip[:, :, use], 1, 2) * weight[:, :, None]
    solve: Array = np.asarray(np.linalg.pinv(system), dtype=float)
    force: Array = np.einsum("mai,mi->ma", solve, torque[:, use] * weight)
    return TipForce(force, solve @ np.swapaxes(solve, 1, 2), np.asarray(np.linalg.cond(system), dtype=float))
