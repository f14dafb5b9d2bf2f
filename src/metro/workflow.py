"""What the Snakefile asks for when it is read: the batches, and the inputs and params of each job.

It is read at every call of snakemake, so nothing heavy is imported here.
"""

from __future__ import annotations

import json
import math
import re
import shlex
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import NamedTuple, Protocol

from metro.batch.cell import cells_findings, shared_cells
from metro.batch.config import load_config
from metro.batch.discover import FoundBatch, discover
from metro.batch.findings import BatchError, Finding
from metro.codehash import code_hash
from metro.units import JSON

# Stage → the file that it writes last.
LAST = {
    "ingest": "data/processed/{batch}/batch.json",
    "identify": "data/processed/{batch}/identified.json",
    "predict": "data/processed/{batch}/prediction.parquet",
    "loop": "data/processed/{batch}/findings.json",
    "verdict": "reports/{batch}/verdict.json",
    "report": "reports/{batch}/report.pdf",
}
# The mark that the summary covers all batches: without it the next call writes the summary again.
COMPLETE = Path("logs/campaign.complete")

# What a stage reads of config.yaml besides the section of its own name: the setting's name → its place there.
SHARED: dict[str, dict[str, tuple[str, ...]]] = {
    "ingest": {"holdout": ("holdout",)},
    "identify": {"model_form_budget": ("loop", "model_form_budget")},
}


class Need(NamedTuple):
    """What a stage's job asks of a scheduler: a base, and more for each megabyte of the batch's raw files.

    For the summary of all batches: more for each batch. Memory of ingest and identify is twice what
    docs/performance.md has for a record; the others are guesses on the safe side.
    """

    memory_mb: float
    memory_mb_each: float
    minutes: float
    minutes_each: float


NEEDS = {
    "ingest": Need(800, 10, 10, 0.1),
    "identify": Need(1500, 50, 60, 1.0),
    "predict": Need(1000, 0, 20, 0.1),
    "loop": Need(1500, 0, 120, 1.0),
    "verdict": Need(500, 0, 5, 0),
    "report": Need(1000, 2, 20, 0.1),
    "campaign": Need(1000, 1, 20, 0.02),
}


class Wildcards(Protocol):
    """Snakemake's wildcards of a job that belongs to one batch."""

    batch: str


@dataclass(frozen=True)
class Plan:
    """The batches found and the settings in force.

    Attributes
    ----------
    discovered : name of a batch → where it is and what it consists of, in alphabetical order.
    config : config.yaml with the sections that the command line replaces.
    cells : folder of the cells' descriptions.
    """

    discovered: Mapping[str, FoundBatch]
    config: JSON
    cells: str

    @classmethod
    def read(cls, checkout: Path, overrides: JSON) -> Plan:
        """Read the settings and find the batches.

        ``config/config.yaml`` is taken from the working directory, else from the checkout; so is the folder
        of cells, as `metro check` has it. ``overrides`` are the sections given to snakemake by ``--config``
        or ``--configfile``.
        """
        settings = Path("config/config.yaml")
        config = load_config(settings if settings.exists() else checkout / settings, overrides)
        cells = shared_cells(Path(config["cells"]), checkout)
        roots = [Path(root) for root in config["raw_roots"]]
        discovered = {batch.name: batch for batch in discover(roots, cells)}
        problems = [*cells_findings(cells), *_unnameable(discovered.values())]
        if not discovered:
            where = ", ".join(map(str, roots))
            problems.append(Finding("error", where, "holds no batch: no folder with a batch.yaml"))
        if problems:
            raise BatchError(problems)
        return cls(discovered, config, str(cells))

    @property
    def batches(self) -> list[str]:
        """Names of all batches."""
        return list(self.discovered)

    @property
    def any_batch(self) -> str:
        """Regular expression that matches the known batches and nothing else."""
        return _any_of(self.discovered)

    @property
    def shell_prefix(self) -> str:
        """Shell code that puts the ``metro`` command of the Python that runs this first in the path."""
        return f'export PATH={shlex.quote(str(Path(sys.executable).parent))}:"$PATH"; '

    def folder(self, wildcards: Wildcards) -> str:
        """Folder of a batch."""
        return str(self.discovered[wildcards.batch].folder)

    def raw_files(self, wildcards: Wildcards) -> list[str]:
        """Every file that a batch consists of, one by one: a changed file in a folder would not be seen."""
        return [str(path) for path in self.discovered[wildcards.batch].inputs]

    def settings(self, stage: str) -> str:
        """Return the settings that a stage uses, as JSON, so that changing any of them re-runs it."""
        shared = {name: reduce(getitem, path, self.config) for name, path in SHARED.get(stage, {}).items()}
        return json.dumps({**self.config.get(stage, {}), **shared}, sort_keys=True)

    def memory(self, stage: str) -> Callable[[Wildcards, int], int]:
        """Return the function that gives the memory, MB, for the first and each further attempt of a job."""
        need = NEEDS[stage]
        return lambda wildcards, attempt: math.ceil(
            attempt * (need.memory_mb + need.memory_mb_each * self._amount(wildcards))
        )

    def minutes(self, stage: str) -> Callable[[Wildcards, int], int]:
        """Return the function that gives the longest time, min, of the first and each further attempt."""
        need = NEEDS[stage]
        return lambda wildcards, attempt: math.ceil(
            attempt * (need.minutes + need.minutes_each * self._amount(wildcards))
        )

    def _amount(self, wildcards: Wildcards) -> float:
        """Megabytes of the raw files of a job's batch; of the job that has none, the number of batches."""
        name = getattr(wildcards, "batch", None)
        if name is None:
            return float(len(self.discovered))
        return sum(path.stat().st_size for path in self.discovered[name].inputs) / 1e6

    def unfinished(self) -> dict[str, str]:
        """Return the batches that lack a result, each with the log of the stage that it stopped at."""
        stopped: dict[str, str] = {}
        for batch in self.discovered:
            written = {stage: Path(last.format(batch=batch)) for stage, last in LAST.items()}
            stage = next((stage for stage, path in written.items() if not path.exists()), None)
            stopped |= {batch: f"logs/{stage}/{batch}.log"} if stage else {}
        return stopped

    def partial_summary(self) -> str:
        """Return the command that summarises what there is, and lists the batches that failed; or ""."""
        logs = self.unfinished()
        if not logs:
            return ""
        finished = [f"reports/{batch}" for batch in self.discovered if batch not in logs]
        failed = [word for batch, log in logs.items() for word in ("--unfinished", f"{batch}={log}")]
        fixed = ["--processed", "data/processed", "--out", "reports", "--settings", self.settings("campaign")]
        return shlex.join(["metro", "campaign", *finished, *failed, *fixed, "--code", self.code("campaign")])

    def code(self, stage: str) -> str:
        """Return the hash of the code that a stage runs."""
        return code_hash(stage)


def files_of(takes: Iterable[str], gives: Iterable[str]) -> str:
    """Return the files that a job takes and gives, as JSON."""
    return json.dumps({"takes": sorted(takes), "gives": list(gives)})


def _any_of(names: Iterable[str]) -> str:
    """Return a regular expression of some names, character by character.

    One after the other they would be tried in turn, for each of the hundreds of files of each batch.
    """
    tails: dict[str, list[str]] = {}
    for name in names:
        tails.setdefault(name[:1], []).append(name[1:])
    longer = "|".join(re.escape(head) + _any_of(endings) for head, endings in tails.items() if head)
    return f"(?:{longer}){'?' if '' in tails else ''}" if longer else ""


def _unnameable(discovered: Iterable[FoundBatch]) -> Iterator[Finding]:
    """Find files that no rule can name, because snakemake reads braces in a path as wildcards."""
    for path in (str(path) for batch in discovered for path in batch.inputs):
        if "{" in path or "}" in path:
            yield Finding("error", path, "has a brace in its name, which snakemake cannot handle: rename it")
