"""Runs cases: breaks a copy of the sound batch, and compares what becomes of it with what must."""

import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import corpus_batches as batches
from corpus_case import Case
from corpus_outcome import Outcome, alike, outcome


class Result(NamedTuple):
    """A case, how its batch fared, and in what that is not what it must be ("" where it is)."""

    case: Case
    outcome: Outcome
    wrong: str


def run(cases: Iterable[Case], folder: Path) -> Iterator[Result]:
    """Run cases in a scratch folder; the sound batch of each kind and format is made and read once."""
    sound: dict[tuple[str, str], Outcome] = {}
    for number, case in enumerate(cases):
        key = case.kind, case.form
        origin = folder / f"sound-{'-'.join(key)}" / "specimen"
        if key not in sound:
            batches.write(origin, *key)
            sound[key] = outcome(origin, origin.parent / "out")
            assert sound[key].how == "read", (key, sound[key])
        trial = folder / f"case-{number}" / "specimen"
        shutil.copytree(origin, trial)
        case.apply(trial)
        found = outcome(trial, trial.parent / "out")
        shutil.rmtree(trial.parent)
        wrong = case.faults_of(found.how, found.said)
        if not wrong and case.how == "read" and not alike(sound[key].tables, found.tables):
            wrong = "read as other numbers than the sound batch's"
        yield Result(case, found, wrong)
