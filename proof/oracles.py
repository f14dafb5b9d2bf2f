"""The oracle of every batch of a suite, in worker processes; what it found is kept in files."""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from metro.batch.config import load_config
from metro.batch.processed import read_json, write_json
from metro.effects.library import library
from metro.observables.problem import Problem
from metro.observables.stability.problem import LabelProblem
from metro.stages.problem_file import FILE, Posed, read_problems
from metro.units import JSON
from proof.label_oracle import label_oracle
from proof.layout import Layout
from proof.limit import OutOfTimeError, bounded
from proof.oracle import oracle
from proof.progress import tracked
from proof.run import CHECKOUT
from proof.suite import ABSORBED

UNKNOWN: JSON = {"before": None, "after": None, "floor": None, "sizes": {}}  # so that all counts as seen


def gates() -> JSON:
    """Return the thresholds of the loop."""
    settings: JSON = load_config(CHECKOUT / "config/config.yaml")["loop"]
    return settings


def oracles(out: Layout, truths: JSON, jobs: int, about: str, limit: float | None = None) -> dict[str, JSON]:
    """Return the oracle's figures of every batch that hides something; those that are there are kept.

    Of a batch whose problems could not be posed there are none.

    Parameters
    ----------
    truths : by batch. about : the observable. limit : of the processor time of a batch, s.
    """
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    hiding = [name for name, truth in truths.items() if truth["effects"]]
    waiting = [name for name in hiding if _stale(out, name)]
    with ProcessPoolExecutor(jobs, get_context("spawn"), max_tasks_per_child=1) as pool:
        futures = [pool.submit(_ask, out, truths[name], about, limit) for name in waiting]
        for future in tracked(futures, "asking the oracle"):
            future.result()
    files = {name: _file(out, name) for name in hiding}
    return {name: read_json(file) for name, file in files.items() if file.is_file()}


def posed(processed: Path, about: str) -> Posed:
    """Return the problem of an observable as the pipeline posed it, with the fit of its base model."""
    return read_problems(processed)[about]


def _file(out: Layout, name: str) -> Path:
    return out.oracle / f"{name}.json"


def _stale(out: Layout, name: str) -> bool:
    """Whether there are problems that the oracle was not asked about."""
    file, problems = _file(out, name), out.processed / name / FILE
    known = file.stat().st_mtime if file.is_file() else 0.0
    return problems.is_file() and problems.stat().st_mtime > known


def _ask(out: Layout, truth: JSON, about: str, limit: float | None) -> None:
    name, hidden = truth["batch"], truth["effects"]
    # What is wholly confounded with the base model would take it anywhere.
    also = {effect: at for effect, at in truth.get("always_on", {}).items() if effect not in ABSORBED}
    task, settings = posed(out.processed / name, about).task, gates()
    result = UNKNOWN
    try:
        with bounded(limit):
            if isinstance(task, LabelProblem):
                result = label_oracle(task, hidden, library(about), settings["held_out_gain"], also)
            elif isinstance(task, Problem) and task.role("validate"):  # else nothing can be compared
                result = oracle(task, hidden, library(about), settings["model_form_budget"], also)
    except OutOfTimeError:
        pass
    write_json(_file(out, name), result)
