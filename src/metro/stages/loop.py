"""Loop: what the prediction leaves over, traced to effects of the library, and the error before and after."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from metro import __version__
from metro.batch.processed import read_batch, read_table, write_json, write_table
from metro.effects import library
from metro.loop.labels import judge_labels
from metro.loop.search import Gates, search
from metro.loop.story import told
from metro.loop.verdict import comparison, held_out, judge, typed
from metro.observables.lobes import LabelProblem
from metro.observables.problem import Problem
from metro.stages.observed import problems, read_json, read_observed
from metro.units import JSON


def loop(processed: Path, reports: Path, settings: JSON, code: str) -> None:
    """Write ``comparison.parquet``, ``loop.json`` and ``verdict.json`` of a batch.

    ``settings``: ``model_form_budget``, ``materiality``, ``false_additions``, ``held_out_gain``, ``seed``.
    """
    batch = read_batch(processed)
    tasks = problems(batch, read_observed(processed), read_json(reports / "identified.json"))
    prediction = read_table(processed / "prediction.parquet")
    gates = Gates(
        budget=settings["model_form_budget"],
        materiality=settings["materiality"],
        false_additions=settings["false_additions"],
        held_out_gain=settings["held_out_gain"],
        seed=settings["seed"],
    )
    tables, verdicts, stories = [], {}, {}
    for name, task in tasks.items():
        before = prediction[prediction["observable"] == name].reset_index(drop=True)
        if isinstance(task, LabelProblem):
            rows, verdicts[name], stories[name] = judge_labels(task, before, gates)
        elif isinstance(task, Problem) and task.role("identify"):
            rows, verdicts[name], stories[name] = _closed(task, before, gates)
        else:
            continue
        tables.append(rows)
    joined = (
        pd.concat([table for table in tables if len(table)], ignore_index=True)
        if any(map(len, tables))
        else prediction
    )
    write_table(processed / "comparison.parquet", typed(joined), {"code": code})
    write_json(processed / "loop.json", {"format": 1, "batch": batch.name, "observables": stories})
    write_json(
        reports / "verdict.json",
        {"format": 1, "batch": batch.name, "metro": __version__, "observables": verdicts},
    )


def _closed(task: Problem, before: pd.DataFrame, gates: Gates) -> tuple[pd.DataFrame, JSON, JSON]:
    """Search for the effects that a problem's model lacks; the held-out runs are read once, for the
    figures.
    """
    outcome = search(task, library(task.observable), gates)
    rows = comparison(task, held_out(task, outcome.base), held_out(task, outcome.final))
    rows["before"] = before["before"]
    verdict = judge(task, outcome, rows, gates)
    return rows, verdict, told(task, outcome, verdict, gates)
