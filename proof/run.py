"""The run: the pipeline's stages on every batch, in worker processes; it knows nothing of what is hidden."""

from __future__ import annotations

import json
import os
import sys
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from metro.batch.processed import COLUMNS, write_json
from metro.observables.registry import observables
from metro.stages.problem_file import FILE
from metro.units import JSON
from metro.workflow import Plan
from proof.layout import Layout
from proof.limit import OutOfTimeError, bounded, ended
from proof.progress import tracked

STAGES = ("ingest", "identify", "predict", "loop", "verdict")
CHECKOUT = Path(__file__).parents[1]
FAILURE = "failed.txt"
FAILED = 3  # exit code of a process whose batch failed, with the reason in its folder


@dataclass(frozen=True)
class Job:
    """A batch to be run: its folders, and the settings and code hash of each stage, in their order.

    ``keep`` the tables of raw signals; ``limit`` of processor time, s; ``only``: the observables whose loop
    is closed (None: of all).
    """

    folder: Path
    cells: Path
    processed: Path
    reports: Path
    settings: Mapping[str, JSON]
    code: Mapping[str, str]
    keep: bool
    limit: float | None = None
    only: tuple[str, ...] | None = None

    @property
    def mark(self) -> Path:
        """File that is written last: the code that ran, and the seconds that each stage took."""
        return self.reports / "run.json"

    @property
    def reason(self) -> Path:
        """File with the reason why the batch failed: where it was, and in the last line what was wrong."""
        return self.reports / FAILURE

    @property
    def done(self) -> bool:
        """Whether this code has run on the batch as it is."""
        if (
            not self.mark.is_file()
            or self.mark.stat().st_mtime < (self.folder / "batch.yaml").stat().st_mtime
        ):
            return False
        mark = json.loads(self.mark.read_text())
        return bool(mark["code"] == self.code and mark.get("only") == (self.only and list(self.only)))


def run(
    out: Layout, jobs: int, *, keep: bool, pdf: bool, through: str | None = None, limit: float | None = None
) -> list[str]:
    """Run the pipeline on every batch that this code has not run on; return the names of those that failed.

    Parameters
    ----------
    keep : leave the tables of raw signals, which nothing needs after the verdict.
    pdf : write the reports, too.
    through : the last observable whose loop is closed; those after it change nothing of its verdict.
    limit : of the processor time of a batch, s: one that takes longer has failed.
    """
    only = None if through is None else _through(through)
    stages = (*STAGES, "report") if pdf else STAGES
    planned = [replace(job, keep=keep, limit=limit, only=only) for job in _planned(out, stages)]
    waiting = [job for job in planned if not job.done]
    failed = _each(_closed, waiting, jobs, "closing the loop")
    return sorted(name for name in failed if name is not None)


def pose(out: Layout, jobs: int, limit: float | None = None) -> None:
    """Pose the problems of every batch that has none: what sizes of effects and baselines are made from."""
    missing = {name for name in out.batches if not (out.processed / name / FILE).is_file()}
    planned = _planned(out, STAGES[:2]) if missing else []
    waiting = [replace(job, limit=limit) for job in planned if job.folder.name in missing]
    _each(_posed, waiting, jobs, "posing problems")


def forgotten(out: Layout) -> None:
    """Remove the problems of all batches, which are large; they can be posed anew."""
    for name in out.batches:
        (out.processed / name / FILE).unlink(missing_ok=True)


def _each(done: Callable[[Job], str | None], waiting: list[Job], jobs: int, doing: str) -> list[str | None]:
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    with ThreadPoolExecutor(jobs) as pool:
        futures = [pool.submit(alone, done, job) for job in waiting]
        return [future.result() for future in tracked(futures, doing)]


def alone(done: Callable[[Job], str | None], job: Job) -> str | None:
    """Run a job in a process of its own; return the name of a batch that failed.

    Compiled code that is interrupted when the time is used up may take its process along. That is a batch
    that failed; the others go on.
    """
    process = get_context("spawn").Process(target=_ended, args=(done, job))
    process.start()
    process.join()
    if process.exitcode:
        _tidied(job)
    if process.exitcode not in (0, FAILED):
        job.reports.mkdir(parents=True, exist_ok=True)
        job.reason.write_text(f"its process ended with exit code {process.exitcode}\n")
    return job.folder.name if process.exitcode else None


def _ended(done: Callable[[Job], str | None], job: Job) -> None:
    """Run a job, and say by the exit code whether it failed."""
    sys.exit(0 if done(job) is None else FAILED)


def _through(observable: str) -> tuple[str, ...]:
    """Name the observables in the order of the loop, up to one of them."""
    names = [each.name for each in observables()]
    return tuple(names[: names.index(observable) + 1])


def _planned(out: Layout, stages: Sequence[str]) -> list[Job]:
    plan = Plan.read(CHECKOUT, {"raw_roots": [str(out.raw)]})
    settings = {stage: json.loads(plan.settings(stage)) for stage in stages}
    code = {stage: plan.code(stage) for stage in stages}
    return [
        Job(
            out.raw / name,
            Path(plan.cells),
            out.processed / name,
            out.reports / name,
            settings,
            code,
            keep=False,
        )
        for name in plan.batches
    ]


def _closed(job: Job) -> str | None:
    """Run the stages of a batch; return its name where one failed, and leave the reason in its folder."""
    for file in ("run.json", "verdict.json", FAILURE):
        (job.reports / file).unlink(missing_ok=True)
    try:
        with bounded(job.limit, ended(job.reason, FAILED)):
            seconds = {stage: _timed(job, stage) for stage in job.settings}
    except Exception:
        job.reports.mkdir(parents=True, exist_ok=True)
        job.reason.write_text(traceback.format_exc())
        return job.folder.name
    finally:
        _tidied(job)
    write_json(job.mark, {"code": dict(job.code), "seconds": seconds, "only": job.only})
    return None


def _posed(job: Job) -> str | None:
    """Run the stages of a batch until its problems are posed; return its name where one failed."""
    try:
        with bounded(job.limit):
            for stage in job.settings:
                _timed(job, stage)
    except (Exception, OutOfTimeError):
        return job.folder.name
    finally:
        _tidied(job)
    return None


def _tidied(job: Job) -> None:
    """Remove the tables of raw signals, unless they are to be kept."""
    for table in () if job.keep else COLUMNS:
        (job.processed / f"{table}.parquet").unlink(missing_ok=True)


def _timed(job: Job, stage: str) -> float:
    from importlib import import_module

    arguments: dict[str, dict[str, Any]] = {
        "ingest": {"folder": job.folder, "cells": job.cells, "out": job.processed},
        "loop": {"processed": job.processed, "reports": job.reports, "only": job.only},
        "verdict": {"processed": job.processed, "reports": job.reports},
        "report": {"processed": job.processed, "reports": job.reports},
    }
    function = getattr(import_module(f"metro.stages.{stage}"), stage)
    start = time.perf_counter()
    function(
        **arguments.get(stage, {"processed": job.processed}),
        settings=job.settings[stage],
        code=job.code[stage],
    )
    return round(time.perf_counter() - start, 3)
