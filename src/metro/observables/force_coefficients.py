"""The cutting coefficients as identified: by waveform, by mean forces, and how well they are told apart."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pandas as pd

from metro.observables.force_model import ForceModel
from metro.observables.problem import BaseFit, Block, Refusal
from metro.observables.quantity import quantity
from metro.units import JSON, Array

AXES = ("x", "y", "z")
INSEPARABLE = 0.98  # correlation of shear and edge term from which they are not told apart


def waveform(model: ForceModel, fit: BaseFit | None) -> JSON | Refusal:
    """Return the coefficients of the joint fit of all waveforms, with their intervals."""
    if fit is None:
        return Refusal("no run has the role identify")
    deviation = np.sqrt(np.diag(fit.covariance))
    return {
        parameter.name: quantity(value / parameter.si, sd / parameter.si, parameter.unit, fit.dof)
        for parameter, value, sd in zip(model.parameters, fit.beta, deviation, strict=True)
    }


def correlation(model: ForceModel, fit: BaseFit | None) -> JSON:
    """Return the correlation of the coefficients' errors, and which shear and edge terms it cannot part."""
    if fit is None:
        return {}
    names = [parameter.name for parameter in model.parameters]
    deviation = np.sqrt(np.diag(fit.covariance))
    told = np.isfinite(deviation)
    matrix = np.eye(len(names))
    matrix[np.ix_(told, told)] = (fit.covariance / np.outer(deviation, deviation))[np.ix_(told, told)]
    together = [
        f"{shear} and {edge}: their errors correlate by {matrix[i, j]:.3f}; cut feeds that differ more"
        for i, shear in enumerate(names)
        for j, edge in enumerate(names)
        if shear.endswith("c") and edge == f"{shear[:-1]}e" and abs(matrix[i, j]) > INSEPARABLE
    ]
    block: JSON = {"correlation": {"coefficients": names, "matrix": matrix.round(6).tolist()}}
    return {**block, "warnings": together} if together else block


def mean_coefficients(model: ForceModel, blocks: tuple[Block, ...], spindle: pd.DataFrame) -> JSON | Refusal:
    """Classical identification: least squares of the mean forces of runs over the feed ([T] §4.1).

    The mean over a revolution does not depend on the start phase, so it needs no waveform. Its intervals come
    from the scatter of the runs about the line.

    Parameters
    ----------
    blocks : runs to use; helical ones are left out. spindle : the observed table, with the mean force of each
        run.
    """
    means = spindle.set_index("run")[[f"mean_{axis}_n" for axis in AXES]]
    straight = [block for block in blocks if block.setting.helix is None]
    rows = [_mean_design(model, block) for block in straight]
    matrix = np.concatenate(rows) if rows else np.zeros((0, 6))
    target = means.loc[[block.run for block in straight]].to_numpy().ravel()
    size = np.linalg.norm(matrix, axis=0)
    if len(target) < 6 or np.linalg.matrix_rank(matrix / np.maximum(size, 1e-300), tol=1e-6) < 6:
        return Refusal(
            "the mean forces of one feed cannot part shear from edge coefficients: cut a second feed"
        )
    beta, residual, _, _ = np.linalg.lstsq(matrix / size, target, rcond=None)
    dof = len(target) - 6
    covariance = np.linalg.inv((matrix / size).T @ (matrix / size))
    variance = float(residual[0]) / dof if dof else math.nan
    sd = np.sqrt(np.diag(covariance) * variance) / size
    return {
        parameter.name: quantity(value / parameter.si, error / parameter.si, parameter.unit, max(dof, 1))
        for parameter, value, error in zip(model.parameters[:6], beta / size, sd, strict=True)
    }


def _mean_design(model: ForceModel, block: Block) -> Array:
    """Mean force per unit of each coefficient on circular paths at the nominal feed, (3, 6).

    In the frame of the comparison.
    """
    nominal = replace(block, setting=replace(block.setting, feed_ratio=1.0))
    matrix, _ = replace(model, true_path=False).design(nominal, np.zeros(1), None)
    first = matrix[: len(matrix) // block.repeats, :6]
    return np.stack([first[zero[: len(first)] > 0].sum(axis=0) for zero in block.zeros.T])
