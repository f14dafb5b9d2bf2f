"""The stages as commands: what snakemake calls, each with the code and the settings that it planned with."""

from __future__ import annotations

import json
import os
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

Processed = Annotated[
    Path, typer.Option(help="Folder of the batch's canonical tables.", exists=True, file_okay=False)
]
Reports = Annotated[Path, typer.Option(help="Folder of the batch's results: reports/BATCH.")]
Settings = Annotated[str, typer.Option(help="What config.yaml says to this stage, as JSON.")]
Code = Annotated[str, typer.Option(help="Hash of the code that the workflow was planned with.")]
Files = Annotated[
    str, typer.Option(help='The files that the stage takes and gives, as JSON: {"takes": […], "gives": […]}.')
]


def ingest(
    folder: Annotated[Path, typer.Argument(help="The batch's folder.", exists=True, file_okay=False)],
    cells: Annotated[Path, typer.Option(help="Folder of the cells' descriptions (CELL.yaml).")],
    out: Annotated[Path, typer.Option(help="Folder that the canonical tables are written to.")],
    settings: Settings,
    code: Code,
) -> None:
    """Check and read a batch's raw files; write canonical tables with one frame, one sign, named units."""
    _run("ingest", settings, code, folder=folder, cells=cells, out=out)


def identify(processed: Processed, settings: Settings, code: Code, files: Files = "") -> None:
    """Identify the models from the identification runs: force coefficients, modes, stiffness."""
    _run("identify", settings, code, files, processed=processed)


def predict(processed: Processed, settings: Settings, code: Code, files: Files = "") -> None:
    """Predict with the base models what was measured on the held-out runs."""
    _run("predict", settings, code, files, processed=processed)


def loop(processed: Processed, reports: Reports, settings: Settings, code: Code, files: Files = "") -> None:
    """Trace what the prediction leaves over to its causes, and say how far each explains it."""
    _run("loop", settings, code, files, processed=processed, reports=reports)


def verdict(
    processed: Processed, reports: Reports, settings: Settings, code: Code, files: Files = ""
) -> None:
    """Put what the loop found into words: the verdicts, their reasons, and what to measure next."""
    _run("verdict", settings, code, files, processed=processed, reports=reports)


def report(processed: Processed, reports: Reports, settings: Settings, code: Code, files: Files = "") -> None:
    """Write the batch's report as PDF."""
    _run("report", settings, code, files, processed=processed, reports=reports)


def campaign(
    *,
    reports: Annotated[
        list[Path] | None, typer.Argument(help="The batches' result folders.", exists=True, file_okay=False)
    ] = None,
    processed: Annotated[
        Path, typer.Option(help="Folder that holds the batches' canonical tables: data/processed.")
    ],
    out: Annotated[Path, typer.Option(help="Folder that the summary is written to.")],
    unfinished: Annotated[
        list[str] | None, typer.Option(help="A batch that failed, and the log that says why: BATCH=LOG.")
    ] = None,
    settings: Settings,
    code: Code,
) -> None:
    """Summarise all batches: one PDF, one table, and what became of parameters from batch to batch."""
    logs = dict(each.split("=", 1) for each in unfinished or [])
    _run("campaign", settings, code, reports=reports or [], processed=processed, out=out, unfinished=logs)


def _run(stage: str, settings: str, code: str, files: str = "", **folders: Any) -> None:
    """Run a stage with the code that the workflow was planned with, or not at all.

    Where its ``files`` are given and all that it takes is as it was, the results that it kept are put back.
    """
    from metro.batch.at_work import job_at_work
    from metro.batch.kept import FRESH, Job, keep, put_back
    from metro.codehash import require_code

    with job_at_work(Path.cwd()):
        require_code(stage, code)
        chosen: dict[str, Any] = json.loads(settings)
        job = Job.planned(stage, files, chosen, code, folders["processed"]) if files else None
        digest = job.digest() if job else ""
        if job and FRESH not in os.environ and put_back(job, digest):
            typer.echo(f"{stage}: takes what it took before; its results are put back")
            return
        function = getattr(import_module(f"metro.stages.{stage}"), stage)
        function(**folders, settings=chosen, code=code)
        if job:
            keep(job, digest)
