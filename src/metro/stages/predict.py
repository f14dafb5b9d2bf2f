"""Predict: the base models, fitted on the identification runs, against the runs that were held out."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd

from metro.batch.processed import read_batch, write_table
from metro.loop.candidate import Candidate
from metro.loop.fit import fit
from metro.loop.noise import first_noise
from metro.loop.verdict import COMPARISON, comparison, held_out, typed
from metro.observables.lobes import LabelProblem
from metro.observables.lobes import comparison as label_comparison
from metro.observables.problem import Problem
from metro.stages.observed import Task, problems, read_json, read_observed
from metro.units import JSON


def predict(processed: Path, settings: JSON, code: str) -> None:
    """Write ``prediction.parquet``: comparison rows of the held-out runs, before any effect.

    ``settings``: ``model_form_budget``.
    """
    batch = read_batch(processed)
    tasks = problems(batch, read_observed(processed), read_json(processed / "identified.json"))
    tables = [_predicted(task, settings["model_form_budget"]) for task in tasks.values()]
    filled = [table for table in tables if len(table)]
    joined = pd.concat(filled, ignore_index=True) if filled else pd.DataFrame(columns=list(COMPARISON))
    provenance = {"code": code, "settings": json.dumps(settings, sort_keys=True)}
    write_table(processed / "prediction.parquet", typed(joined), provenance)


def _predicted(task: Task, budget: float) -> pd.DataFrame:
    """Comparison rows of one observable; none where nothing can be fitted."""
    if isinstance(task, LabelProblem):
        return label_comparison(task)
    if not isinstance(task, Problem) or not task.role("identify", "calibrate"):
        return pd.DataFrame(columns=list(COMPARISON))
    blocks = task.role("identify", "calibrate")
    base = fit(Candidate(task.base), blocks, first_noise(budget, task.scatter, blocks))
    return comparison(task, held_out(task, base))
