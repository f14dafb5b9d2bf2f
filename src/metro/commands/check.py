"""``metro check``: whether batches follow the contract, for people and for programs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path

import typer

from metro.batch.check import CheckReport
from metro.batch.show import render
from metro.commands.calls import CallError
from metro.commands.output import print_json
from metro.commands.which import raw_folder
from metro.report.readable import readable_findings


def check_batches(given: Sequence[str], check: Callable[[Path], CheckReport], as_json: bool) -> int:
    """Print the checks of batches, each given by its name or by a folder of it.

    ``check`` does one: :func:`metro.stages.whole.check_whole`, or a look at the heads of the files.

    Returns
    -------
    code : 0; 1 if a batch has an error; 2 if an argument is no batch (the others are checked all the same).
    """
    folders: list[Path] = []
    code = 0
    for one in given:
        try:
            folders.append(raw_folder(one))
        except CallError as error:
            typer.echo(str(error), err=True)
            code = 2
    reports = [check(folder) for folder in folders]
    reports = [replace(each, problems=(*each.problems, *readable_findings(each.folder))) for each in reports]
    if as_json:
        print_json([_content(report) for report in reports])
    else:
        _print(reports)
    return max([code, *(int(not report.ok) for report in reports)])


def _content(report: CheckReport) -> dict[str, object]:
    return {
        "batch": str(report.folder),
        "ok": report.ok,
        "there": report.there,
        "holdout": report.plan,
        "observables": [asdict(one) for one in report.capabilities],
        "problems": [asdict(one) for one in report.problems],
    }


def _print(reports: Sequence[CheckReport]) -> None:
    from rich.console import Console

    console = Console(highlight=False)
    for report in reports:
        console.print(render(report))
