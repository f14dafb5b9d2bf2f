"""Campaign: the verdicts of all batches become one PDF and one table."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from metro.batch.processed import write_atomically, write_table
from metro.report.campaign import campaign_report, campaign_table
from metro.units import JSON


def campaign(reports: Sequence[Path], out: Path, settings: JSON, code: str) -> None:
    """Write ``summary.parquet`` and ``summary.pdf`` over the result folders ``reports`` of all batches."""
    verdicts = {folder.name: _json(folder / "verdict.json") for folder in reports}
    identified = {folder.name: _json(folder / "identified.json") for folder in reports}
    provenance = {"code": code, "settings": json.dumps(settings), "batches": json.dumps(sorted(verdicts))}
    pdf = campaign_report(verdicts, identified)
    write_table(out / "summary.parquet", campaign_table(verdicts), provenance)
    write_atomically(out / "summary.pdf", lambda stream: stream.write(pdf))


def _json(path: Path) -> JSON:
    content: JSON = json.loads(path.read_text(encoding="utf-8"))
    return content
