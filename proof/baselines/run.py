"""Lets a baseline answer about every batch of a suite, in worker processes."""

from __future__ import annotations

import os
import traceback
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from metro.batch.processed import read_batch, write_json
from metro.effects.library import library
from metro.observables.task import Handler
from metro.stages.problem_file import FILE
from metro.units import JSON
from proof.baselines.base import Base
from proof.baselines.gaussian_process import GaussianProcess
from proof.baselines.program import Given
from proof.baselines.stepwise import Stepwise
from proof.layout import Layout
from proof.limit import OutOfTimeError, bounded
from proof.opening import about_suite
from proof.oracles import gates, posed
from proof.progress import tracked
from proof.run import FAILURE, pose

PROGRAMS: dict[str, Callable[[Given], Handler[JSON]]] = {
    "base": Base,
    "gaussian-process": GaussianProcess,
    "stepwise": Stepwise,
}


def answered(name: str, out: Layout, jobs: int, limit: float | None = None) -> None:
    """Write what a baseline says of every batch; it reads the problems that the pipeline posed, no verdict.

    ``limit``: of the processor time of a batch, s: about one that takes longer nothing is said.
    """
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    pose(out, jobs, limit)
    observable, folder = about_suite(out), out.answers(name)
    waiting = [
        batch
        for batch in out.batches
        if (out.processed / batch / FILE).is_file() and not (folder / f"{batch}.json").is_file()
    ]
    with ProcessPoolExecutor(jobs, get_context("spawn"), max_tasks_per_child=1) as pool:
        futures = [pool.submit(_answer, name, out, batch, observable, limit) for batch in waiting]
        for future in tracked(futures, f"asking {name}"):
            future.result()


def _answer(name: str, out: Layout, batch: str, observable: str, limit: float | None) -> None:
    folder = out.answers(name)
    try:
        with bounded(limit):
            entry = entry_of(name, out, batch, observable)
    except (Exception, OutOfTimeError):
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{batch}.{FAILURE}").write_text(traceback.format_exc())
        return
    write_json(folder / f"{batch}.json", {"format": 1, "batch": batch, "observables": {observable: entry}})


def entry_of(name: str, out: Layout, batch: str, observable: str) -> JSON:
    """Return what a baseline says of a batch."""
    processed, settings = out.processed / batch, gates()
    problem = posed(processed, observable)
    runs = read_batch(processed).runs
    given = Given(
        problem.base, runs, library(observable), settings["model_form_budget"], int(settings["seed"])
    )
    return problem.task.handled_by(PROGRAMS[name](given))
