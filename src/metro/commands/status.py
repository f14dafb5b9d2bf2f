"""``metro status``: which batches are up to date, which stages the others need, and every verdict.

What must run is what snakemake says (``--summary``): it alone knows all its reasons, and a second opinion
would be wrong one day.
"""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from metro.batch.findings import ContractError, Finding
from metro.commands.output import print_json, print_table

STAGES = ("ingest", "identify", "predict", "loop", "report")
COLUMNS = ("output_file", "rule", "status", "plan")
LAST_LINES = 20


@dataclass
class BatchStatus:
    """Stages that must run, in their order, with snakemake's reason; verdict by observable."""

    needs: dict[str, str] = field(default_factory=dict)
    verdicts: dict[str, str] = field(default_factory=dict)


def status_command(snakefile: Path, reports: Path, as_json: bool) -> None:
    """Print what is up to date, what is not, and the verdicts that are there."""
    found, summary = planned(_ask_snakemake(snakefile))
    for name, batch in found.items():
        batch.verdicts = verdicts(reports / name)
    if as_json:
        batches = {
            name: {"up_to_date": not batch.needs, "needs": batch.needs, "verdicts": batch.verdicts}
            for name, batch in found.items()
        }
        print_json(
            {"up_to_date": not summary and not any(b.needs for b in found.values()), "batches": batches}
        )
        return
    rows = [[name, _needs(batch), _verdicts(batch)] for name, batch in found.items()]
    print_table(["batch", "needs", "verdicts"], rows)
    waiting = sum(bool(batch.needs) for batch in found.values())
    told = f"{waiting} of {len(found)} batches need snakemake" if waiting else "every batch is up to date"
    sys.stdout.write(told + (", and so does the summary\n" if summary else "\n"))


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
    found: dict[str, BatchStatus] = {}
    summary = False
    for row in table:
        pending = row["plan"] == "update pending"
        if row["rule"] in STAGES:
            batch = found.setdefault(Path(row["output_file"]).parent.name, BatchStatus())
            if pending:
                batch.needs.setdefault(row["rule"], _reason(row["status"]))
        else:
            summary |= pending
    for batch in found.values():
        batch.needs = {stage: batch.needs[stage] for stage in STAGES if stage in batch.needs}
    return dict(sorted(found.items())), summary


def verdicts(reports: Path) -> dict[str, str]:
    """Return the verdict by observable of a batch; empty where there is none yet."""
    path = reports / "verdict.json"
    if not path.is_file():
        return {}
    content = json.loads(path.read_text(encoding="utf-8"))
    return {name: str(entry.get("status")) for name, entry in (content.get("observables") or {}).items()}


def _ask_snakemake(snakefile: Path) -> list[str]:
    """Return the lines that ``snakemake --summary`` prints; nothing is run or written by it."""
    if not snakefile.is_file():
        message = "is not there: call metro where you call snakemake, or name it with --snakefile"
        raise ContractError([Finding("error", str(snakefile), message)])
    command = [sys.executable, "-m", "snakemake", "--summary", "--snakefile", str(snakefile)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        said = "\n".join(done.stderr.strip().splitlines()[-LAST_LINES:])
        raise ContractError([Finding("error", "snakemake", f"cannot say what must run:\n{said}")])
    return [line for line in done.stdout.splitlines() if "\t" in line]


def _reason(status: str) -> str:
    """Return snakemake's reason; a stage that is "ok" itself runs because one before it does."""
    return "a stage before it" if status == "ok" else status


def _needs(batch: BatchStatus) -> str:
    if not batch.needs:
        return "up to date"
    stages = list(batch.needs)
    reason = next((why for why in batch.needs.values() if why != "a stage before it"), "")
    return ", ".join(stages) + (f" ({reason})" if reason else "")


def _verdicts(batch: BatchStatus) -> str:
    return (
        "\n".join(f"{name}: {status.replace('_', ' ')}" for name, status in batch.verdicts.items()) or "none"
    )
