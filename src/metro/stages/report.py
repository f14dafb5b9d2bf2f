"""Report: everything that was found about a batch becomes one PDF."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pandas as pd

from metro.batch import provenance
from metro.batch.batch import Batch
from metro.batch.processed import Processed, read_batch, write_json
from metro.batch.writing import write_atomically
from metro.observables import force_metrics
from metro.observables.end_stiffness import end_stiffness
from metro.observables.mean_forces import mean_forces
from metro.observables.record_view import record_tables
from metro.observables.robot_tables import robot_tables
from metro.report.batch_report import batch_report
from metro.report.results import Results
from metro.units import JSON

TABLES = (
    "qc",
    "spindle",
    "comparison",
    "face_indices",
    "face_contacts",
    "lobes_final",
    "lobe_methods",
    "lobe_islands",
    "lobe_stations",
    "chatter_runs",
    "chatter_records",
    "lobe_runs",
    "yielding",
    "frf_used",
    "stabilisation",
    "mode_shapes",
    "mode_mac",
    "waviness_points",
    "joint_friction",
    "joint_friction_curve",
    "face_map",
    "published_errors",
    "published_modes",
    "published_loads",
    "published_forces",
)

FORCE_TABLES = ("orders", "spindle", "force_refused")


def report(processed: Path, reports: Path, settings: JSON, code: str) -> None:
    """Write a batch's ``report.pdf``, and ``provenance.json``: the hashes of all that it was made from."""
    pdf = batch_report(read_results(processed, reports, settings, code))
    write_atomically(reports / "report.pdf", lambda stream: stream.write(pdf))
    write_json(reports / provenance.FILE, provenance.record(processed, reports, settings, code))


def read_results(processed: Path, reports: Path, settings: JSON, code: str) -> Results:
    """Read what the stages before left; tables that are absent or empty are left out."""
    tables = _tables(processed, TABLES)
    batch = read_batch(processed)
    tables = {name: table for name, table in tables.items() if len(table)}
    tables |= _force_figures(batch, tables.get("comparison"))
    identified = _json(reports / "identified.json")
    read = Processed(processed)
    tables |= robot_tables(batch, read, identified, tables.get("waviness_points"))
    tables |= mean_forces(batch, _tables(processed, FORCE_TABLES), identified) | record_tables(
        batch, read, tables.get("qc")
    )
    return Results(
        batch=batch,
        tables=tables | end_stiffness(read),
        identified=identified,
        verdict=_json(reports / "verdict.json"),
        loop=_json(processed / "loop.json"),
        sources=_sources(processed),
        stages=provenance.stages(processed, settings, code),
        packages=provenance.packages(),
    )


def _tables(processed: Path, names: tuple[str, ...]) -> dict[str, pd.DataFrame]:
    return {name: pd.read_parquet(p) for name in names if (p := processed / f"{name}.parquet").exists()}


def _force_figures(batch: Batch, comparison: pd.DataFrame | None) -> dict[str, pd.DataFrame]:
    """Figures of merit of the held-out forces that were measured over the revolution."""
    teeth = int((batch.manifest.get("tool") or {}).get("teeth") or 0)
    if comparison is None or not teeth:
        return {}
    rows = comparison[(comparison["observable"] == "force") & comparison["angle_deg"].notna()]
    if rows.empty:
        return {}
    rows = rows.fillna({"after": rows["before"]})
    return {
        "force_metrics": force_metrics.metrics(rows, teeth),
        "force_orders": force_metrics.order_spectrum(rows),
    }


def _json(path: Path) -> JSON:
    content: JSON = json.loads(path.read_text(encoding="utf-8"))
    return content


def _sources(processed: Path) -> dict[str, str]:
    """SHA-256 by source file, from the provenance in the metadata of all processed tables."""
    import pyarrow.parquet as pq

    found: dict[str, Any] = {}
    for path in sorted(processed.glob("*.parquet")):
        metadata = pq.read_schema(path).metadata or {}
        found |= json.loads(metadata.get(b"metro.sources", b"{}"))
    return {str(name): str(digest) for name, digest in found.items()}
