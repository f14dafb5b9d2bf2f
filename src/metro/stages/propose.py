"""``metro propose``: for what stays unexplained in the force of a batch, a term that would explain it.

The search starts from the fit of the base model that ``identify`` keeps, with the effects of the verdict.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from metro import __version__
from metro.batch.findings import ContractError, Finding
from metro.batch.processed import read_json
from metro.batch.provenance import made_by
from metro.batch.writing import write_atomically
from metro.discovery.draft import files
from metro.discovery.example import Workshop, rows_of
from metro.discovery.record import record
from metro.discovery.search import Search, searched
from metro.discovery.words import in_words
from metro.effects.library import library
from metro.loop.search.trial import Gates
from metro.loop.statement import to_json
from metro.observables.problem import Problem
from metro.stages.problem_file import FILE, read_problems
from metro.units import JSON
from metro.wording.statements import worded

OBSERVABLE = "force"
INSTALL = "pip install --no-deps --no-build-isolation -e"


def propose(batch: str, *, write: Path | None, processed: Path, reports: Path, as_json: bool) -> None:
    """Print what could explain the residual of a batch's force; write a draft of it where asked to.

    Raises
    ------
    ContractError
        The batch has no results, or ``write`` is there already.
    """
    if write and write.exists():
        raise ContractError([Finding("error", str(write), "is there already: give another folder")])
    said, search, problem = proposed(processed / batch, reports / batch)
    lines = in_words(batch, said)
    if said.get("proposal") and search and problem:
        lines += _drafted(batch, said, search, problem, write)
    if as_json:
        sys.stdout.write(json.dumps({"batch": batch, **said}, indent=1, ensure_ascii=False) + "\n")
    else:
        sys.stdout.write("\n".join(lines) + "\n")


def proposed(processed: Path, reports: Path) -> tuple[JSON, Search | None, Problem | None]:
    """Search a batch, and return what is said of it, in words where the loop has statements.

    Where nothing is unexplained, nothing is searched.
    """
    for file in (processed / FILE, processed / "loop.made.json", reports / "verdict.json"):
        if not file.is_file():
            raise ContractError([Finding("error", str(file), "is not there: call metro run")])
    verdict = read_json(reports / "verdict.json")["observables"][OBSERVABLE]
    if verdict["unexplained"] is None or verdict.get("contradicted"):
        return {"status": "explained", "verdict": verdict["status"], "proposal": None}, None, None
    posed = read_problems(processed)[OBSERVABLE]
    if not isinstance(posed.task, Problem) or posed.base is None:
        message = "has no force that a model is fitted to, expected records of the force"
        raise ContractError([Finding("error", processed.name, message)])
    gates = Gates(**made_by(processed, "loop")["settings"])
    search = searched(posed.task, posed.base, verdict["effects"], gates)
    found: Any = worded(to_json(record(search, posed.task)))
    return {"status": "searched", "verdict": verdict["status"], **found}, search, posed.task


def _drafted(batch: str, said: JSON, search: Search, problem: Problem, write: Path | None) -> list[str]:
    """Write a draft of the proposal, or say how; return the sentences on it."""
    chosen = search.proposal
    if chosen is None:
        return []
    if write is None:
        return ["", "Write it as a draft with --write FOLDER, read it, and accept it by installing it."]
    if chosen.entry.name in {effect.name for effect in library()}:
        raise ContractError([Finding("error", chosen.entry.name, "is the name of an effect already")])
    model: Any = search.current.candidate.base
    shop = Workshop(
        model.cutter.radius,
        model.cutter.helix,
        model.cutter.tooth_angles,
        tuple(float(f"{value:.4g}") for value in search.current.beta[:6]),
        rows_of(problem.role("identify")),
    )
    write.mkdir(parents=True)
    for name, text in files(batch, __version__, chosen.entry, said, shop).items():
        _write(write / name, text)
    return [
        "",
        f"The draft is in {write}. Read it, then test it: pytest {write}.",
        f"Accept it with: {INSTALL} {write}. From then on metro tries it like any other effect.",
    ]


def _write(path: Path, text: str) -> None:
    write_atomically(path, lambda stream: stream.write(text.encode()))
