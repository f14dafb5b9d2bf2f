"""Report: everything that was found about a batch becomes one PDF, and the same as a page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pandas as pd

from metro.batch import provenance
from metro.batch.batch import Batch
from metro.batch.processed import Processed, read_batch, write_json
from metro.batch.writing import write_atomically
from metro.observables.arm.end_stiffness import end_stiffness
from metro.observables.arm.link_mass import link_masses
from metro.observables.arm.robot_tables import robot_tables
from metro.observables.catalogue import shown_tables
from metro.observables.cut.record_view import record_tables
from metro.observables.flatness.path_errors import path_errors
from metro.observables.flatness.struck import struck_tables
from metro.observables.force import metrics as force_metrics
from metro.observables.force.mean_forces import mean_forces
from metro.report.batch_report import report_pdf, report_sections
from metro.report.page.report_page import report_page
from metro.report.results import Results
from metro.stages.problem_file import read_problems
from metro.units import JSON

# What the loop and the reading of the raw files left, beside the observed tables.
TABLES = ("qc", "comparison", "lobes_final")


def report(processed: Path, reports: Path, settings: JSON, code: str) -> None:
    """Write ``report.pdf``, the same as ``report.html``, and ``provenance.json``: what they are made from."""
    results = read_results(processed, reports, settings, code)
    sections = report_sections(results)
    pdf, page = report_pdf(results, sections), report_page(results, sections)
    write_atomically(reports / "report.pdf", lambda stream: stream.write(pdf))
    write_atomically(reports / "report.html", lambda stream: stream.write(page.encode()))
    write_json(reports / provenance.FILE, provenance.record(processed, reports, settings, code))


def read_results(processed: Path, reports: Path, settings: JSON, code: str) -> Results:
    """Read what the stages before left; tables that are absent or empty are left out."""
    tables = _tables(processed, (*TABLES, *shown_tables()))
    batch = read_batch(processed)
    tables = {name: table for name, table in tables.items() if len(table)}
    tables |= _force_figures(batch, tables.get("comparison"))
    identified = _json(reports / "identified.json")
    read = Processed(processed)
    tables |= robot_tables(batch, read, identified, tables.get("waviness_points"))
    tables |= link_masses(batch, read, identified) | _struck(processed, tables.get("frf_used"))
    tables |= path_errors(tables.get("comparison"), tables.get("published_errors"))
    tables |= _mean_forces(batch, processed, tables, identified) | record_tables(
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


def _struck(processed: Path, responses: pd.DataFrame | None) -> dict[str, pd.DataFrame]:
    """Tables of the struck tip, where impacts showed modes."""
    modes = _tables(processed, ("modes",)).get("modes")
    if responses is None or modes is None:
        return {}
    return struck_tables(Processed(processed), modes, responses)


def _mean_forces(
    batch: Batch, processed: Path, tables: dict[str, pd.DataFrame], identified: JSON
) -> dict[str, pd.DataFrame]:
    if "spindle" not in tables:
        return {}
    posed = read_problems(processed).get("force")
    return mean_forces(batch, tables["spindle"], identified, posed.task if posed else None)


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

    sources: dict[str, Any] = {}
    for path in sorted(processed.glob("*.parquet")):
        metadata = pq.read_schema(path).metadata or {}
        sources |= json.loads(metadata.get(b"metro.sources", b"{}"))
    return {str(name): str(digest) for name, digest in sources.items()}
