"""Loop: what the prediction leaves over, traced to effects of the library, and the error before and after.

The observables are taken in order. Where effects were found in the cutting force, its coefficients are those
refitted with them, and the observables that start from the coefficients are predicted anew: their error after
includes what was found upstream.
"""

from __future__ import annotations

import json
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from pathlib import Path

import pandas as pd

from metro import __version__
from metro.batch.batch import Batch
from metro.batch.processed import Processed, read_batch, read_table, write_json, write_table
from metro.effects import library
from metro.loop.batch_story import brief
from metro.loop.fit import Fit
from metro.loop.labels import judge_labels
from metro.loop.search import Gates, Outcome, search
from metro.loop.story import told
from metro.loop.verdict import COMPARISON, comparison, held_out, identified_fit, judge, stands, typed
from metro.loop.witnesses import Closed
from metro.observables import flatness, lobes, published
from metro.observables.face_advice import after_loop
from metro.observables.lobes import LabelProblem
from metro.observables.problem import Problem, Refusal
from metro.stages.across import across
from metro.stages.observed import (
    MODULES,
    OBSERVED_WITH_COEFFICIENTS,
    Task,
    merged,
    read_json,
    read_observed,
    task_of,
)
from metro.units import JSON


@dataclass
class Closing:
    """The loop of one batch while its observables are closed one after another."""

    batch: Batch
    processed: Path
    gates: Gates
    prediction: pd.DataFrame
    identified: JSON
    observed: dict[str, pd.DataFrame]
    tables: list[pd.DataFrame] = field(default_factory=list)
    verdicts: JSON = field(default_factory=dict)
    stories: JSON = field(default_factory=dict)
    closed: dict[str, Closed] = field(default_factory=dict)

    @property
    def found(self) -> list[JSON]:
        """Effects that changed the cutting coefficients."""
        entry: JSON = self.verdicts.get("force") or {}
        return list(entry.get("effects") or [])


def loop(processed: Path, reports: Path, settings: JSON, code: str) -> None:
    """Write ``comparison``, ``lobes_final``, ``loop.json``, and the ``verdict.json`` and ``identified.json``.

    ``settings``: ``model_form_budget``, ``materiality``, ``false_additions``, ``held_out_gain``, ``seed``.
    """
    state = closed(processed, Gates(**settings))
    _write(state, reports, {"code": code, "settings": json.dumps(settings, sort_keys=True)})


def closed(
    processed: Path, gates: Gates, only: Collection[str] | None = None, limits: JSON | None = None
) -> Closing:
    """Close the loop of a batch's observables (or ``only`` some), one after another, and write nothing.

    ``limits`` of settings, [least, largest] by column of the run table, within which runs may be proposed.
    """
    batch = read_batch(processed)
    state = Closing(
        batch=replace(batch, manifest={**batch.manifest, "limits": limits}) if limits else batch,
        processed=processed,
        gates=gates,
        prediction=read_table(processed / "prediction.parquet"),
        identified=read_json(processed / "identified.json"),
        observed=read_observed(processed),
    )
    if "published_errors" in state.observed:
        for printed in published.problems(state.batch, state.observed, state.identified):
            _close(state, printed)
    else:
        for module in MODULES:
            if only is not None and module.OBSERVABLE not in only:
                continue
            if state.found and module in OBSERVED_WITH_COEFFICIENTS:
                again = module.observe(state.batch, Processed(processed), state.identified)
                state.observed |= {} if isinstance(again, Refusal) else again
            task = task_of(module, state.batch, state.observed, state.identified)
            outcome = _close(state, task)
            if outcome and isinstance(task, Problem):
                state.closed[task.observable] = Closed(task, outcome)
            fitted = identified_fit(task, outcome.final) if outcome and isinstance(task, Problem) else None
            mended = state.found or (module is lobes and state.verdicts.get("lobes", {}).get("effects"))
            if mended and (fitted or (module is lobes and "modes" in state.observed)):
                blocks = module.report(state.batch, state.observed, state.identified, task, fitted)
                state.identified = merged(state.identified, blocks)
            if module is flatness and isinstance(task, Problem) and outcome:
                _rank_again(state, task, outcome.final)
    return state


def _rank_again(state: Closing, task: Problem, final: Fit) -> None:
    """Rank the configurations of faces as predicted with the effects found, where there are any."""
    if final.candidate.effects:
        with_effects = replace(task, base=final.candidate.model(final.theta))
        fitted = identified_fit(task, final)
        told = flatness.report(state.batch, state.observed, state.identified, with_effects, fitted)
        state.identified = merged(state.identified, after_loop(told))


def _close(state: Closing, task: Task) -> Outcome | None:
    """Close the loop of one observable; the held-out runs are read once, for the figures."""
    if isinstance(task, LabelProblem):
        before = state.prediction[state.prediction["observable"] == task.observable].reset_index(drop=True)
        after = lobes.comparison(task)["before"]
        rows, verdict, story, change = judge_labels(
            task, before.assign(after=after), state.found, library(task.observable), state.gates
        )
        if change:
            state.observed["lobes"] = lobes.redrawn(task, state.observed["lobes"], change)
    elif isinstance(task, Problem) and task.role("identify"):
        before = state.prediction[state.prediction["observable"] == task.observable].reset_index(drop=True)
        outcome = stands(task, search(task, library(task.observable), state.gates))
        rows = comparison(task, held_out(task, outcome.base), held_out(task, outcome.final))
        rows["before"] = before["before"]
        verdict = judge(task, outcome, rows, state.gates)
        story = told(task, outcome, verdict, state.gates)
    else:
        return None
    state.tables.append(rows)
    state.verdicts[task.observable] = verdict
    state.stories[task.observable] = story
    return None if isinstance(task, LabelProblem) else outcome


def _write(state: Closing, reports: Path, provenance: dict[str, str]) -> None:
    filled = [table for table in state.tables if len(table)]
    joined = pd.concat(filled, ignore_index=True) if filled else pd.DataFrame(columns=list(COMPARISON))
    name, processed = state.batch.name, state.processed
    write_table(processed / "comparison.parquet", typed(joined), provenance)
    diagram = state.observed.get("lobes", pd.DataFrame())
    write_table(processed / "lobes_final.parquet", diagram, provenance)
    said = across(state.closed, state.verdicts, joined, state.observed, state.gates)
    write_json(processed / "loop.json", {"format": 1, "batch": name, "observables": state.stories, **said})
    write_json(reports / "identified.json", state.identified)
    verdict = {"format": 1, "batch": name, "metro": __version__, "observables": state.verdicts}
    verdict["causes"] = [brief(cause) for cause in said["causes"]]
    write_json(reports / "verdict.json", verdict)
