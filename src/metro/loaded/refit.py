"""Fits of a batch's models: of the base model, and of it with effects that a user chooses or has written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from metro.effects.effect import Effect, fitted_to
from metro.loaded.settings import wrong
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Fit, fit
from metro.loop.fitting.held_out import comparison, held_out, run_dof
from metro.loop.fitting.noise import first_noise
from metro.observables.problem import Problem
from metro.observables.quantity import quantity
from metro.stages.problem_file import Posed
from metro.units import Array


@dataclass(frozen=True, eq=False)
class FitReport:
    """A fit on the identification runs, and what it predicts of those held out.

    Attributes
    ----------
    effects : names of the effects beside the base model.
    parameters : ``name, value, lo, hi, unit`` of every parameter, the base model's first.
    converged : whether the descent reached the most likely values.
    condition : number of the whitened columns; infinite where a parameter is not determined.
    rank : how many of the parameters the runs determine.
    log_likelihood : of the identification runs.
    comparison : the held-out runs in the columns of ``comparison.parquet``: ``before`` is the base model.
    held_out_rms : rms of measured less predicted on the held-out runs, in the observable's unit; NaN without.
    """

    observable: str
    effects: tuple[str, ...]
    parameters: pd.DataFrame
    converged: bool
    condition: float
    rank: int
    log_likelihood: float
    comparison: pd.DataFrame = field(repr=False)
    held_out_rms: float
    unit: str

    def __str__(self) -> str:
        names = ", ".join(self.effects) or "no effect"
        ended = "converged" if self.converged else "did not converge"
        error = f"held-out error {self.held_out_rms:.3g} {self.unit}"
        return f"{self.observable} with {names}: {ended}, {error}, log-likelihood {self.log_likelihood:.1f}"


def refit(posed: Posed | None, observable: str, effects: Sequence[Effect], budget: float) -> FitReport:
    """Fit the base model of an observable with some effects on it.

    Parameters
    ----------
    posed : the problem with the fit of its base model. budget : the model-form budget.

    Raises
    ------
    ContractError
        The batch has no such model, or cannot show one of the effects.
    """
    if posed is None or not isinstance(posed.task, Problem) or posed.base is None:
        reason = (
            getattr(posed.task, "reason", "it is not fitted to samples") if posed else "it is not observed"
        )
        raise wrong(observable, f"has no model that could be fitted: {reason}")
    problem, base = posed.task, posed.base
    for effect in effects:
        if observable not in effect.observables:
            raise wrong(effect.name, f"is an effect on {', '.join(effect.observables)}, not on {observable}")
    able, unable = fitted_to(tuple(effects), problem, moot=True)
    if unable:
        raise wrong(*next(iter(unable.items())))
    fitted = base
    if able:
        blocks = problem.role("identify", "calibrate")
        fitted = fit(
            Candidate(problem.base, able), blocks, first_noise(budget, problem.scatter, blocks), base
        )
    rows = comparison(problem, held_out(problem, base), held_out(problem, fitted))
    error = float(np.sqrt(((rows["measured"] - rows["after"]) ** 2).mean())) if len(rows) else float("nan")
    return FitReport(
        observable,
        tuple(effect.name for effect in able),
        _parameters(problem, fitted),
        fitted.converged,
        fitted.condition,
        fitted.rank,
        fitted.total,
        rows,
        error,
        problem.unit,
    )


def _parameters(problem: Problem, fitted: Fit) -> pd.DataFrame:
    """Return base and effect parameters with their 95 % intervals, in the units of the outputs."""
    base = [(p.name, p.unit, p.si) for p in problem.base.parameters]
    of_effects = [
        (f"{effect.name}.{p.name}", p.unit, 1.0)
        for effect in fitted.candidate.effects
        for p in effect.parameters
    ]
    values: Array = np.concatenate([fitted.beta, fitted.theta])
    deviations = np.sqrt(np.diag(fitted.covariance) * fitted.dispersion)
    rows = []
    for (name, unit, si), value, sd in zip([*base, *of_effects], values, deviations, strict=True):
        entry = quantity(value / si, sd / si, unit, run_dof(fitted))
        rows.append((name, entry["value"], *entry["ci95"], unit))
    return pd.DataFrame(rows, columns=["name", "value", "lo", "hi", "unit"])
