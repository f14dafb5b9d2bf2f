"""``python -m proof.slips``: every slip in every suitable batch, and what the check and the report say of it.

Outcomes: *caught by check* (an error, or a contradiction, that the batch as it is does not give), *flagged on
page one*, *undecidable* (no datum of the batch contradicts it, for the reason that the list gives), *without
effect* (no figure leaves its interval and the verdicts are the same to the last digit), and two that must not
be: *named a false cause* and *clean without a word*.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from metro.batch.batch import Batch
from metro.batch.findings import Finding
from metro.batch.processed import Tables, read_json
from metro.dataset.results import quantities
from metro.stages.contradictions import contradictions
from metro.stages.whole import check_whole
from metro.units import JSON
from metro.workflow import Plan
from proof.run import CHECKOUT, STAGES
from proof.slip_edits import Mistake
from proof.slip_list import mistakes

CAUGHT, FLAGGED, UNDECIDABLE = "caught by check", "flagged on page one", "undecidable"
IDLE = "without effect"
FALSE_CAUSE, SILENT = "NAMED A FALSE CAUSE", "CLEAN WITHOUT A WORD"
NEVER = (FALSE_CAUSE, SILENT)


@dataclass(frozen=True)
class Ended:
    """What the stages wrote: ``verdict.json`` and ``identified.json``."""

    verdict: JSON
    identified: JSON


@dataclass(frozen=True)
class Result:
    """What became of a slip in a batch; ``said`` is what the check or page one said."""

    slip: str
    batch: str
    outcome: str
    said: str = ""


def tried(folder: Path, slips: Sequence[Mistake], *, loop: bool) -> Iterator[Result]:
    """Make each slip in a copy of a batch and run the check, and the stages where it says nothing.

    ``loop``: run the stages; else a slip that the check does not catch is given as such.
    """
    known = _said(folder)
    clean: Ended | None = None
    for slip in slips:
        with tempfile.TemporaryDirectory() as place:
            copy = Path(place) / "raw" / folder.name
            shutil.copytree(folder, copy)
            if not slip.edit(copy):
                continue
            new = [text for text in _said(copy) if text not in known]
            if new:
                yield Result(slip.name, folder.name, CAUGHT, new[0])
                continue
            if why := slip.why_undecidable(folder):
                yield Result(slip.name, folder.name, UNDECIDABLE, why)
                continue
            if not loop:
                yield Result(slip.name, folder.name, "not caught by check")
                continue
            clean = clean or _ended(folder, Path(place) / "clean")
            yield _judged(slip, folder.name, clean, _ended(copy, Path(place) / "out"))


def _said(folder: Path) -> list[str]:
    """Return the errors of the check, and the contradictions that it finds; no other warning counts."""
    found: list[str] = []

    def also(batch: Batch, read: Tables) -> Iterator[Finding]:
        for finding in contradictions(batch, read):
            if finding.severity == "warning":  # a note on what a model leaves out contradicts nothing
                found.append(str(finding))
            yield finding

    report = check_whole(folder, CHECKOUT / "config/cells", also=also)
    return [*(str(one) for one in report.problems if one.severity == "error"), *found]


def _ended(folder: Path, out: Path) -> Ended:
    """Run the stages of a batch; return what they say."""
    plan = Plan.read(CHECKOUT, {"raw_roots": [str(folder.parent)]})
    processed, reports = out / "processed", out / "reports"
    given = {
        "ingest": {"folder": folder, "cells": Path(plan.cells), "out": processed},
        "loop": {"processed": processed, "reports": reports},
        "verdict": {"processed": processed, "reports": reports},
    }
    for stage in STAGES:
        run = getattr(import_module(f"metro.stages.{stage}"), stage)
        run(**given.get(stage, {"processed": processed}), settings=json.loads(plan.settings(stage)), code="")
    return Ended(read_json(reports / "verdict.json"), read_json(reports / "identified.json"))


def _judged(slip: Mistake, batch: str, before: Ended, after: Ended) -> Result:
    """Compare what the stages say with what they say of the batch as it is."""
    clean, verdict = before.verdict, after.verdict
    if verdict == clean and not _moved(before.identified, after.identified):
        return Result(slip.name, batch, IDLE)
    entries = verdict["observables"]
    flagged = [one["words"] for one in verdict.get("contradictions") or []]
    flagged += [f"{name} misses half of the signal" for name in entries if "misses" in entries[name]]
    flagged += [
        words
        for name in entries
        if _holds(clean, name) and not _holds(verdict, name)
        for words in [entries[name]["verification"]["words"]]
    ]
    causes = _causes(verdict) - _causes(clean)
    if causes:
        return Result(slip.name, batch, FALSE_CAUSE, ", ".join(sorted(causes)))
    if flagged:
        return Result(slip.name, batch, FLAGGED, flagged[0])
    now = _statuses(verdict)
    worse = [
        f"{name}: {status} → {now.get(name, 'lost')}"
        for name, status in _statuses(clean).items()
        if now.get(name, "lost") not in (status, "clean")
    ]
    return Result(slip.name, batch, FLAGGED if worse else SILENT, "; ".join(worse))


def _holds(verdict: JSON, name: str) -> bool:
    """Whether the held-out runs do not contradict an observable's result; so where there are none."""
    verification = (verdict["observables"].get(name) or {}).get("verification")
    return verification is None or bool(verification["holds"])


def _moved(clean: JSON, identified: JSON) -> bool:
    """Whether any identified figure came, went, or left the interval that it had."""
    here = {name: value for name, value, *_ in quantities(identified)}
    there = {name: (value, low, high) for name, value, low, high, _ in quantities(clean)}
    return set(here) != set(there) or any(
        here[name] != value and (low is None or high is None or not low <= (here[name] or math.nan) <= high)
        for name, (value, low, high) in there.items()
    )


def _statuses(verdict: JSON) -> dict[str, str]:
    return {name: one["status"] for name, one in verdict["observables"].items()}


def _causes(verdict: JSON) -> set[str]:
    entries = verdict["observables"].items()
    return {f"{name}: {one['effect']}" for name, entry in entries for one in entry["effects"]}


def main(arguments: list[str] | None = None) -> None:
    """Print the table slip × batch × outcome; exit with 1 where an outcome must not be."""
    parser = argparse.ArgumentParser(prog="python -m proof.slips", description=__doc__)
    parser.add_argument("batches", type=Path, nargs="+", help="folders of batches")
    parser.add_argument("--few", action="store_true", help="a few of the wrong orientations, the check alone")
    parser.add_argument("--check", action="store_true", help="the check alone")
    parser.add_argument("--slip", default="", help="only slips whose name contains this")
    options = parser.parse_args(arguments)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    chosen = [one for one in mistakes(full=not options.few) if options.slip in one.name]
    count: Counter[str] = Counter()
    for folder in options.batches:
        for result in tried(folder, chosen, loop=not (options.few or options.check)):
            count[result.outcome] += 1
            print(f"| {result.slip} | {result.batch} | {result.outcome} | {result.said} |", flush=True)
    print("; ".join(f"{outcome}: {number}" for outcome, number in count.most_common()))
    sys.exit(int(any(count[outcome] for outcome in NEVER)))


if __name__ == "__main__":
    main()
