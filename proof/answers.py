"""What a program says of a batch: the core of verdict.json, which is all that is scored (answer.schema.json).

A verdict.json of this pipeline is such a file, and so is a much smaller one that anybody's program writes.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

from metro.units import JSON

SCHEMA = Path(__file__).with_name("answer.schema.json")
# What an observable's entry may leave out, and what is then taken for it.
ABSENT: JSON = {
    "before": None,
    "after": None,
    "noise_floor": None,
    "effects": [],
    "candidates": [],
    "indistinguishable": [],
    "unexplained": None,
    "next_experiment": None,
    "cannot_be_seen": [],
    "p_value": None,
    "seconds": None,
}


class AnswerError(ValueError):
    """A file is not what the schema says."""


def answer(folder: Path, name: str, observable: str) -> JSON | None:
    """Return the entry of an observable in ``<name>.json``, complete; None if there is no file or no entry.

    Raises
    ------
    AnswerError
        The file is not what the schema says; the message names the file and the place.
    """
    file = folder / f"{name}.json"
    if not file.is_file():
        return None
    content = json.loads(file.read_text())
    errors = sorted(_validator().iter_errors(content), key=lambda error: list(map(str, error.path)))
    if errors:
        raise AnswerError(f"{file}: {errors[0].json_path}: {errors[0].message}")
    entry = content["observables"].get(observable)
    return None if entry is None else complete(entry)


def complete(entry: JSON) -> JSON:
    """Return an entry with all that it leaves out."""
    effects = [{"probability": None, "parameters": {}, **one} for one in entry.get("effects", [])]
    return {**ABSENT, **entry, "effects": effects}


def p_value(findings: JSON | None, observable: str) -> float | None:
    """Probability of a residual like this pipeline's of a batch if nothing is missing, by findings.json.

    Of effects that were tried it is the smallest p-value corrected for their number (Simes, Biometrika 73
    (1986) 751), which is uniform if nothing is there; of labels, their surprise under the base model.
    """
    entry = (findings or {"observables": {}})["observables"].get(observable)
    if entry is None:
        return None
    story = entry["story"]
    tried = [one["q_value"] for one in story["candidates"] if "q_value" in one]
    if tried:
        return float(min(tried))
    before = story["noise"]["words"].get("values", {}).get("before")
    return None if before is None else float(before)


@cache
def _validator() -> Any:
    from jsonschema import Draft202012Validator

    return Draft202012Validator(json.loads(SCHEMA.read_text()))
