"""Verdict: the findings of the loop are put into words; nothing is fitted, so that this takes no time."""

from __future__ import annotations

from pathlib import Path

from metro.batch.processed import read_json, write_json
from metro.batch.provenance import write_made
from metro.units import JSON
from metro.wording.batch import story_of, verdict_of


def verdict(processed: Path, reports: Path, settings: JSON, code: str) -> None:
    """Write ``loop.json`` and ``verdict.json`` of a batch, from its ``findings.json``.

    ``settings``: none.
    """
    findings = read_json(processed / "findings.json")
    write_json(processed / "loop.json", story_of(findings))
    write_json(reports / "verdict.json", verdict_of(findings))
    write_made(processed, "verdict", settings, code)
