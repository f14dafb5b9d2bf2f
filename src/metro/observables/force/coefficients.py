"""The identified cutting coefficients: from waveforms, from mean forces, and their correlation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from metro.observables.force.model import ForceModel
from metro.observables.problem import BaseFit, Block, Refusal
from metro.observables.quantity import quantity
from metro.units import JSON, Array

AXES = ("x", "y", "z")
IN_PLANE = ("ktc", "krc", "kte", "kre")
NOT_IDENTIFIED_ON = "no run has the role identify"
INSEPARABLE = 0.98  # correlation from which on shear and edge term cannot be distinguished


def waveform(model: ForceModel, fit: BaseFit | None, *, turned: bool) -> JSON | Refusal:
    """Return the coefficients of the joint fit of all waveforms, with their intervals.

    ``turned``: all runs are helical, and their start on the orbit is unknown. The force in the plane is then
    identified only up to a rotation, and the tangential and radial coefficients are not identifiable.
    """
    if fit is None:
        return Refusal(NOT_IDENTIFIED_ON)
    deviation = np.sqrt(np.diag(fit.covariance))
    return {
        parameter.name: quantity(value / parameter.si, sd / parameter.si, parameter.unit, fit.dof)
        for parameter, value, sd in zip(model.parameters, fit.beta, deviation, strict=True)
        if not (turned and parameter.name in IN_PLANE)
    }


def correlation(model: ForceModel, fit: BaseFit | None) -> JSON:
    """Return the correlation of the coefficients' errors, and the shear and edge terms not separated."""
    if fit is None:
        return {}
    names = [parameter.name for parameter in model.parameters]
    deviation = np.sqrt(np.diag(fit.covariance))
    known = np.isfinite(deviation)
    matrix = np.eye(len(names))
    matrix[np.ix_(known, known)] = (fit.covariance / np.outer(deviation, deviation))[np.ix_(known, known)]
    together = [
        f"{shear} and {edge}: their errors correlate by {matrix[i, j]:.3f}; cut feeds that differ more"
        for i, shear in enumerate(names)
        for j, edge in enumerate(names)
        if shear.endswith("c") and edge == f"{shear[:-1]}e" and abs(matrix[i, j]) > INSEPARABLE
    ]
    block: JSON = {"correlation": {"coefficients": names, "matrix": matrix.round(6).tolist()}}
    return {**block, "warnings": together} if together else block


def mean_coefficients(
    model: ForceModel,
    blocks: tuple[Block, ...],
    spindle: pd.DataFrame,
    changes: Mapping[str, Array] | None = None,
) -> JSON | Refusal:
    """Classical identification: least squares of the mean forces of runs over the feed ([T] §4.1).

    The mean over a revolution does not depend on the start phase, so it needs no waveform. The chip is that
    of circular paths at the nominal feed. The intervals contain the scatter of the runs (the change of the
    coefficients as each run is omitted), and the error that the circular paths cause.

    Parameters
    ----------
    blocks : runs to use; helical ones are omitted. spindle : the observed table, with the mean force of each
        run. changes : by run, what (3,), N, of its mean force is no matter of the coefficients.
    """
    if not blocks:
        return Refusal(NOT_IDENTIFIED_ON)
    means = spindle.set_index("run")[[f"mean_{axis}_n" for axis in AXES]]
    straight = [block for block in blocks if block.setting.helix is None]
    if not straight:
        return Refusal("all runs are helical: their mean forces turn with the orbit")
    circular, true = (
        np.array([mean_design(model, block, true_path=path) for block in straight]).reshape(-1, 3, 6)
        for path in (False, True)
    )
    target = means.loc[[block.run for block in straight]].to_numpy()
    if changes:
        target = target - np.array([changes[block.run] for block in straight])
    size = np.sqrt((circular**2).sum(axis=(0, 1)))
    scaled = circular / np.maximum(size, 1e-300)
    if not _parted(scaled):
        return Refusal(
            "the mean forces of one feed cannot separate shear and edge coefficients: cut a second feed"
        )
    solve = np.linalg.pinv(scaled.reshape(-1, 6))
    beta = solve @ target.ravel()
    off = solve @ ((true - circular) @ (beta / size)).ravel()
    deviation = np.hypot(_left_out(scaled, target - scaled @ beta), off)
    return {
        parameter.name: quantity(
            value / parameter.si, error / parameter.si, parameter.unit, max(len(straight) - 2, 1)
        )
        for parameter, value, error in zip(model.parameters[:6], beta / size, deviation / size, strict=True)
    }


def _parted(designs: Array) -> bool:
    """Whether the runs of (n, 3, 6) designs identify all six coefficients."""
    return bool(designs.size and np.linalg.matrix_rank(designs.reshape(-1, 6), tol=1e-6) == 6)


def _left_out(designs: Array, residual: Array) -> Array:
    """Root of the sum of squared changes (6,) of the coefficients as each run is omitted.

    It is not a number if the fit needs every run. ``designs`` (n, 3, 6), ``residual`` (n, 3).
    """
    if not all(_parted(np.delete(designs, i, axis=0)) for i in range(len(designs))):
        return np.full(6, math.nan)
    own = np.einsum("iac,iad->icd", designs, designs)
    moves = np.linalg.solve(own.sum(axis=0) - own, np.einsum("iac,ia->ic", designs, residual)[..., None])
    return np.asarray(np.sqrt((moves**2).sum(axis=(0, 2))))


def mean_design(model: ForceModel, block: Block, *, true_path: bool, beta: Array | None = None) -> Array:
    """Mean force per unit of each coefficient at the nominal feed, (3, 6), in the comparison's frame.

    ``beta``: coefficients of the force to which a tool yields, where the model has one.
    """
    nominal = replace(block, setting=replace(block.setting, feed_ratio=1.0))
    matrix, _ = replace(model, true_path=true_path).design(nominal, np.zeros(1), beta)
    first = matrix[: len(matrix) // block.repeats, :6]
    return np.stack([first[zero[: len(first)] > 0].sum(axis=0) for zero in block.zeros.T])
