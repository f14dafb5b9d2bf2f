"""``metro check``: whether batches follow the contract, for people and for programs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from metro.batch.check import CheckReport, check
from metro.batch.findings import Finding
from metro.batch.show import render
from metro.commands.alike import alike_as_one
from metro.commands.calls import CallError
from metro.commands.output import print_json
from metro.commands.which import RAW_FILE, raw_folder

if TYPE_CHECKING:
    from rich.console import RenderableType


def check_batches(given: Sequence[str], cells: Path, as_json: bool) -> int:
    """Print the checks of batches, each given by its name or a folder of it.

    Returns
    -------
    code : 0; 1 where a batch has an error; 2 where something given is no batch (the others are checked).
    """
    folders: list[Path] = []
    code = 0
    for one in given:
        try:
            folders.append(raw_folder(one))
        except CallError as error:
            typer.echo(str(error), err=True)
            code = 2
    reports = [check(folder, cells) for folder in folders]
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
    from rich.console import Console, Group

    console = Console(highlight=False)
    for report in reports:
        console.print(Group(*_parts(report)))


def _parts(report: CheckReport) -> Iterator[RenderableType]:
    """Yield what the check shows, findings that are alike as one, and counted one by one."""
    from rich.table import Table

    *parts, counts = *render(_shortened(report)).renderables[:-1], render(report).renderables[-1]
    unread = any(
        one.file == RAW_FILE and one.severity == "error" and not one.column for one in report.problems
    )
    # Of a batch whose description cannot be read nothing can be computed: the table would say so of each.
    yield from (part for part in parts if not (unread and isinstance(part, Table)))
    yield counts


def _shortened(report: CheckReport) -> CheckReport:
    problems = [
        Finding(severity, "", line)
        for severity in ("note", "warning", "error")
        for line in alike_as_one(str(one) for one in report.problems if one.severity == severity)
    ]
    return replace(report, problems=tuple(problems))
