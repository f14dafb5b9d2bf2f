"""The run: the pipeline's stages on every batch, in worker processes; it knows nothing of what is hidden."""

from __future__ import annotations

import json
import os
import time
import traceback
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

from metro.batch.processed import COLUMNS, write_json
from metro.units import JSON
from metro.workflow import Plan
from proof.layout import Layout
from proof.progress import tracked

STAGES = ("ingest", "identify", "predict", "loop", "verdict")
CHECKOUT = Path(__file__).parents[1]


@dataclass(frozen=True)
class Job:
    """A batch to be run: its folders, and the settings and code hash of each stage, in their order."""

    folder: Path
    cells: Path
    processed: Path
    reports: Path
    settings: Mapping[str, JSON]
    code: Mapping[str, str]
    keep: bool

    @property
    def mark(self) -> Path:
        """File that is written last: the code that ran, and the seconds that each stage took."""
        return self.reports / "run.json"

    @property
    def done(self) -> bool:
        """Whether this code has run on the batch as it is."""
        if (
            not self.mark.is_file()
            or self.mark.stat().st_mtime < (self.folder / "batch.yaml").stat().st_mtime
        ):
            return False
        return bool(json.loads(self.mark.read_text())["code"] == self.code)


def run(out: Layout, jobs: int, *, keep: bool, pdf: bool) -> list[str]:
    """Run the pipeline on every batch that this code has not run on; return the names of those that failed.

    Parameters
    ----------
    keep : leave the tables of raw signals, which nothing needs after the verdict.
    pdf : write the reports, too.
    """
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    waiting = [job for job in _planned(out, keep, pdf) if not job.done]
    with ProcessPoolExecutor(jobs, get_context("spawn"), max_tasks_per_child=1) as pool:
        futures = [pool.submit(_closed, job) for job in waiting]
        failed = [future.result() for future in tracked(futures, "closing the loop")]
    return sorted(name for name in failed if name is not None)


def _planned(out: Layout, keep: bool, pdf: bool) -> list[Job]:
    plan = Plan.read(CHECKOUT, {"raw_roots": [str(out.raw)]})
    stages = (*STAGES, "report") if pdf else STAGES
    settings = {stage: json.loads(plan.settings(stage)) for stage in stages}
    code = {stage: plan.code(stage) for stage in stages}
    return [
        Job(out.raw / name, Path(plan.cells), out.processed / name, out.reports / name, settings, code, keep)
        for name in plan.batches
    ]


def _closed(job: Job) -> str | None:
    """Run the stages of a batch; return its name where one failed, and leave the reason in its folder."""
    for file in ("run.json", "verdict.json", "failed.txt"):
        (job.reports / file).unlink(missing_ok=True)
    try:
        seconds = {stage: _timed(job, stage) for stage in job.settings}
    except Exception:
        job.reports.mkdir(parents=True, exist_ok=True)
        (job.reports / "failed.txt").write_text(traceback.format_exc())
        return job.folder.name
    if not job.keep:
        for table in COLUMNS:
            (job.processed / f"{table}.parquet").unlink(missing_ok=True)
    write_json(job.mark, {"code": dict(job.code), "seconds": seconds})
    return None


def _timed(job: Job, stage: str) -> float:
    from importlib import import_module

    folders: dict[str, dict[str, Path]] = {
        "ingest": {"folder": job.folder, "cells": job.cells, "out": job.processed},
        "loop": {"processed": job.processed, "reports": job.reports},
        "verdict": {"processed": job.processed, "reports": job.reports},
        "report": {"processed": job.processed, "reports": job.reports},
    }
    function = getattr(import_module(f"metro.stages.{stage}"), stage)
    start = time.perf_counter()
    function(
        **folders.get(stage, {"processed": job.processed}), settings=job.settings[stage], code=job.code[stage]
    )
    return round(time.perf_counter() - start, 3)
