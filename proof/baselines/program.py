"""What a baseline is given and what it returns: each is a handler of tasks (metro.observables.task)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from metro.effects.effect import Effect
from metro.loop.fitting.fit import Fit
from metro.loop.fitting.held_out import comparison, held_out
from metro.observables.problem import Problem
from metro.units import JSON

TOO_FEW: JSON = {"status": "insufficient"}


@dataclass(frozen=True, eq=False)
class Given:
    """What a program knows beside the problem.

    Attributes
    ----------
    base : fit of the base model to the identification runs; None where there is none.
    runs : run table with a row for each run, by its name.
    effects : the library. budget : relative model-form budget. seed : of what is drawn.
    """

    base: Fit | None
    runs: pd.DataFrame
    effects: tuple[Effect, ...]
    budget: float
    seed: int


def said(status: str, rows: pd.DataFrame, **more: object) -> JSON:
    """Return the answer of a program; ``rows`` of the held-out runs with ``before`` and ``after``."""
    errors = {column: _rms(rows["measured"] - rows[column]) for column in ("before", "after")}
    return {"status": status, **errors, "effects": [], "unexplained": None, **more}


def held_out_rows(problem: Problem, base: Fit, final: Fit | None = None) -> pd.DataFrame:
    """Return the comparison of the held-out runs; without a ``final`` fit nothing is corrected."""
    return comparison(problem, held_out(problem, base), held_out(problem, final or base))


def _rms(difference: pd.Series[float]) -> JSON | None:
    return {"rms": float(np.sqrt(np.mean(difference**2)))} if len(difference) else None
