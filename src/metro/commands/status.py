"""``metro status``: which batches are up to date, which stages the others need, and every verdict.

What must run is what snakemake says (``--summary``): it alone knows all its reasons, and a second opinion
would be wrong one day.
"""

from __future__ import annotations

import csv
import json
import re
import subprocess
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from metro.batch.findings import ContractError, Finding
from metro.commands.output import print_json, print_table
from metro.commands.workflow_file import workflow_file

STAGES = ("ingest", "identify", "predict", "loop", "verdict", "report")
COLUMNS = ("output_file", "rule", "status", "plan")
LOGS = "log-file(s)"
LAST_LINES = 20
# How the log of a stage ends that failed: the last line of a traceback, or what was wrong with its input.
_FAILED = re.compile(r"([\w.]*(Error|Exception|Interrupt|OutOfTime)\b|error\b|Killed)")


@dataclass
class BatchStatus:
    """Stages that must run, in their order, with snakemake's reason; verdict by observable.

    ``refused`` : the first error that the check of its raw files finds; "" where there is none.
    ``logs`` : of the stages that have no output, in snakemake's order of outputs.
    ``failed`` : the stage that failed, how its log ends, and where that is; "" where none did.
    """

    needs: dict[str, str] = field(default_factory=dict)
    verdicts: dict[str, str] = field(default_factory=dict)
    refused: str = ""
    logs: dict[str, str] = field(default_factory=dict)
    failed: str = ""


def status_command(snakefile: Path | None, reports: Path, as_json: bool) -> None:
    """Print what is up to date, what is not and why, and the verdicts that are there.

    Parameters
    ----------
    snakefile : the workflow; None: the one of this folder, else that of the checkout metro is installed from.
    """
    workflow = workflow_file(snakefile)
    batches, summary = planned(_ask_snakemake(workflow))
    for name, batch in batches.items():
        batch.verdicts = verdicts(reports / name)
        batch.failed = failure(batch)
    _look_for_refused({name: batch for name, batch in batches.items() if STAGES[0] in batch.needs}, workflow)
    if as_json:
        content = {
            name: {
                "up_to_date": not batch.needs,
                "needs": batch.needs,
                "verdicts": batch.verdicts,
                **({"refused": batch.refused} if batch.refused else {}),
                **({"failed": batch.failed} if batch.failed else {}),
            }
            for name, batch in batches.items()
        }
        print_json(
            {"up_to_date": not summary and not any(b.needs for b in batches.values()), "batches": content}
        )
        return
    rows = [[name, _needs(batch), _verdicts(batch)] for name, batch in batches.items()]
    print_table(["batch", "needs", "verdicts"], rows)
    refused = sum(bool(batch.refused) for batch in batches.values())
    waiting = sum(bool(batch.needs) for batch in batches.values())
    need = f"{waiting} of {len(batches)} batches need snakemake" if waiting else "every batch is up to date"
    sys.stdout.write(need + (", and so does the summary\n" if summary else "\n"))
    failed = [name for name, batch in batches.items() if batch.failed and not batch.refused]
    if failed:
        sys.stdout.write(
            f"{len(failed)} failed: after mending the cause, snakemake goes on where it stopped\n"
        )
    if refused:
        sys.stdout.write(f"{refused} refused: metro check says all that is to be mended\n")


def planned(lines: Iterable[str]) -> tuple[dict[str, BatchStatus], bool]:
    """Read what ``snakemake --summary`` prints.

    Parameters
    ----------
    lines : tab-separated, the first of them the header; one line for each output file of the workflow.

    Returns
    -------
    batches : status by name, in alphabetical order, without verdicts.
    summary : whether the summary of the campaign must be written.

    Raises
    ------
    ContractError
        A column is missing that this version of metro knows.
    """
    table = csv.DictReader(lines, delimiter="\t")
    missing = set(COLUMNS) - set(table.fieldnames or [])
    if missing:
        message = f"its --summary lacks the columns {', '.join(sorted(missing))}: another version than 9?"
        raise ContractError([Finding("error", "snakemake", message)])
    batches: dict[str, BatchStatus] = {}
    summary = False
    for row in table:
        pending = row["plan"] == "update pending"
        if row["rule"] in STAGES:
            batch = batches.setdefault(Path(row["output_file"]).parent.name, BatchStatus())
            if pending:
                batch.needs.setdefault(row["rule"], _reason(row["status"]))
                if row["status"] == "missing" and row.get(LOGS):
                    batch.logs.setdefault(row["rule"], row[LOGS].split(",")[0])
        else:
            summary |= pending
    for batch in batches.values():
        batch.needs = {stage: batch.needs[stage] for stage in STAGES if stage in batch.needs}
    return dict(sorted(batches.items())), summary


def verdicts(reports: Path) -> dict[str, str]:
    """Return the verdict by observable of a batch; empty where there is none yet."""
    path = reports / "verdict.json"
    if not path.is_file():
        return {}
    content = json.loads(path.read_text(encoding="utf-8"))
    return {name: str(entry.get("status")) for name, entry in (content.get("observables") or {}).items()}


def failure(batch: BatchStatus) -> str:
    """Say which stage without output failed when it last ran, by the end of its log; "" where none did."""
    for stage in STAGES:
        log = Path(batch.logs.get(stage, ""))
        lines = log.read_text("utf-8", "replace").split("\n") if stage in batch.logs and log.is_file() else []
        last = next((line.strip() for line in reversed(lines) if line.strip()), "")
        if _FAILED.match(last):
            return f"{stage} failed: {last} ({log})"
    return ""


def _look_for_refused(unread: Mapping[str, BatchStatus], workflow: Path) -> None:
    """Say of batches whose raw files are to be read that they cannot be, where that is so."""
    if not unread:
        return
    from metro.batch.check import check
    from metro.batch.findings import errors
    from metro.observables.catalogue import capabilities
    from metro.workflow import Plan

    plan = Plan.read(workflow.resolve().parent, {})
    for name, batch in unread.items():
        if name in plan.discovered:
            folder = plan.discovered[name].folder
            looked = check(folder, Path(plan.cells), plan.config["holdout"], capabilities)
            faults = errors(looked.problems)
            batch.refused = str(faults[0]) if faults else ""


def _ask_snakemake(snakefile: Path) -> list[str]:
    """Return the lines that ``snakemake --summary`` prints; nothing is run or written by it."""
    command = [sys.executable, "-m", "snakemake", "--summary", "--snakefile", str(snakefile)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        said = "\n".join(done.stderr.strip().splitlines()[-LAST_LINES:])
        raise ContractError([Finding("error", "snakemake", f"cannot say what must run:\n{said}")])
    return [line for line in done.stdout.splitlines() if "\t" in line]


def _reason(status: str) -> str:
    """Return snakemake's reason; a stage that is "ok" itself runs because one before it does."""
    return {"ok": "a stage before it", "missing": "not made yet"}.get(status, status)


def _needs(batch: BatchStatus) -> str:
    if not batch.needs:
        return "up to date"
    if batch.refused:
        return f"refused: {batch.refused}"
    if batch.failed:
        return batch.failed
    stages = list(batch.needs)
    reason = next((why for why in batch.needs.values() if why != "a stage before it"), "")
    return ", ".join(stages) + (f" ({reason})" if reason else "")


def _verdicts(batch: BatchStatus) -> str:
    return (
        "\n".join(f"{name}: {status.replace('_', ' ')}" for name, status in batch.verdicts.items()) or "none"
    )
