"""Predict: the base models, fitted on the identification runs, against the runs that were held out."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from metro.batch.processed import write_table
from metro.batch.provenance import write_made
from metro.loop.fitting.fit import Fit
from metro.loop.fitting.held_out import COMPARISON, comparison, held_out, typed
from metro.observables.labelled import Labelled
from metro.observables.problem import Problem, Refusal
from metro.stages.problem_file import read_problems
from metro.units import JSON


@dataclass(frozen=True)
class Predicted:
    """Handler: comparison rows of the held-out runs, by the fit of the base model; none without one."""

    base: Fit | None

    def sampled(self, problem: Problem) -> pd.DataFrame:
        """Predict the held-out runs of a problem."""
        if self.base is None:
            return pd.DataFrame(columns=list(COMPARISON))
        return comparison(problem, held_out(problem, self.base))

    def labelled(self, problem: Labelled) -> pd.DataFrame:
        """Return the probability of each held-out label."""
        return problem.comparison()

    def refused(self, _refusal: Refusal) -> pd.DataFrame:
        """Return no rows."""
        return pd.DataFrame(columns=list(COMPARISON))


def predict(processed: Path, settings: JSON, code: str) -> None:
    """Write ``prediction.parquet``: comparison rows of the held-out runs, before any effect."""
    posed = read_problems(processed).values()
    tables = [each.task.handled_by(Predicted(each.base)) for each in posed]
    filled = [table for table in tables if len(table)]
    joined = pd.concat(filled, ignore_index=True) if filled else pd.DataFrame(columns=list(COMPARISON))
    write_table(processed / "prediction.parquet", typed(joined))
    write_made(processed, "predict", settings, code)
