"""A fit against the runs that were held out: what it predicts of them, in the rows of the comparison table.

This is all that prediction needs of the loop: it imports neither the search nor the verdict.
"""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from metro.loop.fitting.fit import Fit, polished, score
from metro.loop.fitting.noise import block_sigma
from metro.observables.problem import BaseFit, Problem
from metro.units import Array

COMPARISON = (
    *("observable", "run", "axis", "t_s", "angle_deg", "s_mm", "x_mm", "y_mm"),
    *("measured", "before", "after", "sigma", "unit"),
)


@dataclass(frozen=True)
class Held:
    """The held-out runs under a fit: rows of the comparison, in the problem's unit, by run."""

    predicted: dict[str, Array]
    sigma: dict[str, Array]


def held_out(problem: Problem, fitted: Fit) -> Held:
    """Predict the validation runs; only their own unknowns (start phase) are estimated from them."""
    blocks = problem.role("validate")
    if not blocks:
        return Held({}, {})
    scored = score(fitted, blocks)
    model = scored.candidate.model(scored.theta)
    predicted, sigma = {}, {}
    for block in blocks:
        matrix, offset = model.design(block, scored.nuisance[block.run], scored.beta)
        predicted[block.run] = block.compared(offset + matrix @ scored.beta) / problem.si
        sigma[block.run] = block_sigma(block, fitted.noise, matrix, fitted.beta) / problem.si
    return Held(predicted, sigma)


def comparison(problem: Problem, before: Held, after: Held | None = None) -> pd.DataFrame:
    """Return the held-out runs' rows of comparison.parquet; ``after`` is None before the loop has run."""
    parts = []
    for block in problem.role("validate"):
        measured = block.compared(block.measured) / problem.si
        rows: dict[str, object] = dict.fromkeys(COMPARISON)
        rows |= {
            "observable": problem.observable,
            "run": block.run,
            "unit": problem.unit,
            **block.coordinates,
        }
        rows |= {
            "measured": measured,
            "before": before.predicted[block.run],
            "sigma": before.sigma[block.run],
        }
        if after is not None:
            rows |= {"after": after.predicted[block.run], "sigma": after.sigma[block.run]}
        parts.append(pd.DataFrame(rows, index=range(len(measured))))
    table = pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=list(COMPARISON))
    return typed(table)


def typed(table: pd.DataFrame) -> pd.DataFrame:
    """Give the columns of a comparison table their types, in the contract's order."""
    text = ("observable", "run", "axis", "unit")
    return table.reindex(columns=list(COMPARISON)).astype(
        {name: "str" if name in text else "float64" for name in COMPARISON}
    )


def identified_fit(problem: Problem, fitted: Fit) -> BaseFit:
    """Return the base parameters of a fit, with the unknowns of the held-out runs beside those of its own."""
    held, fitted = problem.role("validate"), polished(fitted)
    nuisance = {**fitted.nuisance, **(score(fitted, held).nuisance if held else {})}
    p = len(fitted.beta)
    covariance = fitted.covariance[:p, :p] * fitted.dispersion
    return BaseFit(fitted.beta, covariance, run_dof(fitted), nuisance)


def run_dof(fitted: Fit) -> float:
    """Degrees of freedom of intervals: runs (and load tests) less one; a sample is no evidence of its own."""
    return float(max(1, len(fitted.blocks) - 1))
