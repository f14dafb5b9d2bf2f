"""What the effects found make of the coefficients that the mean forces give: their bias, and them without it.

The classical identification takes every tooth to cut its feed × sine. With runout a tooth may lift out of the
cut and leave its chip to the next: the shear force of a revolution stays, but less of the edges rubs, and the
less the smaller the feed. Over the feed that is a slope, which the classical identification reads as shear.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pandas as pd

from metro.observables.force.coefficients import mean_coefficients, mean_design
from metro.observables.force.model import ForceModel
from metro.observables.problem import BaseFit, Block, Problem, Refusal
from metro.units import JSON, MM, Array

SETS = {"mean": "identify", "mean_all_runs": ""}  # the role of the runs; "": all
ROUNDING = 1e-6  # of the forces: a change of the means that is none


def mean_bias(
    base: ForceModel, problem: Problem, spindle: pd.DataFrame, reported: JSON, fit: BaseFit
) -> JSON:
    """Return ``mean_bias`` and ``mean_corrected``; nothing where the effects found leave the means alone.

    Parameters
    ----------
    base : the model without effects. problem : with the effects found in its model. spindle : the observed
        table. reported : the block ``force`` of identified.json. fit : coefficients with the effects.

    Returns
    -------
    JSON
        ``mean_corrected``: the six coefficients from the mean forces of the identification runs less what
        the effects change in them. ``mean_bias``: by set of ``SETS`` how much these change each coefficient;
        ``edge_in_cut``: by feed per tooth (mm) the share of the edges' way through the work on which they
        cut.
    """
    model = problem.base
    assert isinstance(model, ForceModel)
    straight = [block for block in problem.blocks if block.setting.helix is None]
    changes = {block.run: _change(base, model, block, fit.beta) for block in straight}
    forces = [mean_design(base, block, true_path=True) @ fit.beta[:6] for block in straight]
    if not straight or _size(changes.values()) <= ROUNDING * _size(forces):
        return {}
    bias: JSON = {}
    corrected: JSON = {}
    for name, role in SETS.items():
        blocks = tuple(block for block in straight if role in ("", block.role))
        without = mean_coefficients(base, blocks, spindle, changes)
        if isinstance(without, Refusal) or name not in reported:
            continue
        corrected[name] = without
        bias[name] = {
            key: {"value": reported[name][key]["value"] - one["value"], "ci95": None, "unit": one["unit"]}
            for key, one in without.items()
        }
    if not bias:
        return {}
    shares = {
        f"{block.setting.cut.feed_per_tooth / MM:.4g}": _in_cut(base, model, block) for block in straight
    }
    bias["edge_in_cut"] = dict(sorted(shares.items(), key=lambda one: float(one[0])))
    return {"mean_bias": bias} | ({"mean_corrected": corrected["mean"]} if "mean" in corrected else {})


def _size(forces: Iterable[Array]) -> float:
    return max((float(np.abs(force).max()) for force in forces), default=0.0)


def _change(base: ForceModel, model: ForceModel, block: Block, beta: Array) -> Array:
    """Mean force (3,), N, of a run with the effects found less that without them."""
    found = mean_design(model, block, true_path=True, beta=beta)
    return np.asarray((found - mean_design(base, block, true_path=True)) @ beta[:6])


def _in_cut(base: ForceModel, model: ForceModel, block: Block) -> float:
    """Share of the edges' way through the work on which they cut: the edge force acts there alone."""
    found, whole = (np.abs(mean_design(each, block, true_path=True)[:, 5]).sum() for each in (model, base))
    return float(found / whole) if whole else math.nan
