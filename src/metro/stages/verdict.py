"""Verdict: the findings of the loop are put into words, and what follows from the results is decided.

Nothing is fitted, so that this takes no time.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from metro.batch.processed import read_batch, read_json, write_json
from metro.batch.provenance import write_made
from metro.decisions.cuts import CUT, Milling, Reach, recommended_cuts
from metro.decisions.results import decisions
from metro.units import JSON
from metro.wording.batch import story_of, verdict_of


def verdict(processed: Path, reports: Path, settings: JSON, code: str) -> None:
    """Write ``loop.json`` and ``verdict.json`` of a batch, from its ``findings.json`` and its results.

    ``settings``: none.
    """
    findings = read_json(processed / "findings.json")
    content = verdict_of(findings)
    write_json(processed / "loop.json", story_of(findings))
    write_json(reports / "verdict.json", content | _decided(processed, reports, content))
    write_made(processed, "verdict", settings, code)


def _decided(processed: Path, reports: Path, verdict: JSON) -> JSON:
    """Return the decisions on stated tolerances, and the cuts to use where there are lobes."""
    batch, identified = read_batch(processed), read_json(reports / "identified.json")
    decided: JSON = {}
    if batch.manifest.get("tolerances"):
        orders = pd.read_parquet(processed / "orders.parquet")
        decided["decisions"] = decisions(batch.manifest, identified, orders)
    lobes, milling = (
        pd.read_parquet(processed / "lobes_final.parquet"),
        Milling.of(batch.manifest, identified),
    )
    if len(lobes) and milling:
        tests = pd.read_parquet(processed / "lobe_runs.parquet").join(batch.runs[list(CUT)], on="run")
        status = (verdict["observables"].get("lobes") or {}).get("status")
        reach = Reach.of(batch.manifest, batch.runs, pd.read_parquet(processed / "frf_used.parquet"))
        decided["recommended_cuts"] = recommended_cuts(lobes, tests, status, milling, reach)
    return decided
