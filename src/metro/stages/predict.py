"""Predict: the base models, fitted on the identification runs, against the runs that were held out."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from metro.batch.processed import read_batch, write_table
from metro.loop.fit import Candidate, fit
from metro.loop.noise import first_noise
from metro.loop.verdict import COMPARISON, comparison, held_out, typed
from metro.observables.lobes import LabelProblem
from metro.observables.lobes import comparison as label_comparison
from metro.observables.problem import Problem
from metro.stages.observed import problems, read_json, read_observed
from metro.units import JSON


def predict(processed: Path, reports: Path, settings: JSON, code: str) -> None:
    """Write ``prediction.parquet``: comparison rows of the held-out runs, before any effect.

    ``settings``: ``model_form_budget``.
    """
    batch = read_batch(processed)
    tasks = problems(batch, read_observed(processed), read_json(reports / "identified.json"))
    tables = [pd.DataFrame(columns=list(COMPARISON))]
    for task in tasks.values():
        if isinstance(task, LabelProblem):
            tables.append(label_comparison(task))
        elif isinstance(task, Problem) and task.role("identify", "calibrate"):
            blocks = task.role("identify", "calibrate")
            base = fit(
                Candidate(task.base), blocks, first_noise(settings["model_form_budget"], task.scatter, blocks)
            )
            tables.append(comparison(task, held_out(task, base)))
    written = typed(pd.concat([table for table in tables if len(table)] or tables, ignore_index=True))
    write_table(processed / "prediction.parquet", written, {"code": code})
