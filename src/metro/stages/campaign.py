"""Campaign: the verdicts of all batches become a PDF, a web page, a table, and a memory over the batches."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from urllib.parse import quote

from metro.batch.processed import read_batch, read_table, write_json, write_table
from metro.batch.writing import write_atomically
from metro.memory.history import Record
from metro.memory.remember import remember
from metro.observables.catalogue import drawn_tables
from metro.report.campaign import campaign_report, campaign_sections, campaign_table
from metro.report.page.build import campaign_page
from metro.report.results import Results, with_facts, without_lone_intervals
from metro.units import JSON

# What the page draws of the loop, beside the observed tables.
PAGE = ("comparison", "lobes_final")


def campaign(
    reports: Sequence[Path],
    processed: Path,
    out: Path,
    settings: JSON,
    code: str,
    *,
    unfinished: Mapping[str, str] | None = None,
) -> None:
    """Write ``summary.parquet``, ``memory.json``, ``summary.pdf`` and ``summary.html`` over all batches.

    Parameters
    ----------
    reports : the batches' result folders. processed : the folder that holds each batch's processed folder.
    unfinished : batches that failed, each with the log that says why.
    """
    verdicts = {
        folder.name: with_facts(_json(folder / "verdict.json"), _json(processed / folder.name / "loop.json"))
        for folder in reports
    }
    identified = {folder.name: _json(folder / "identified.json") for folder in reports}
    memory = remember([_record(processed / name, verdicts[name], identified[name]) for name in verdicts])
    failed = {batch: _reason(Path(log)) for batch, log in (unfinished or {}).items()}
    provenance = {"code": code, "settings": json.dumps(settings), "batches": json.dumps(sorted(verdicts))}
    links = {f.name: quote(os.path.relpath(f / "report.pdf", out)) for f in reports}
    shown = {
        name: without_lone_intervals(verdict, read_batch(processed / name).runs)
        for name, verdict in verdicts.items()
    }
    pdf = campaign_report(shown, identified, memory, failed, links)
    write_table(out / "summary.parquet", campaign_table(verdicts, failed), provenance)
    write_json(out / "memory.json", memory)
    write_atomically(out / "summary.pdf", lambda stream: stream.write(pdf))
    page = campaign_page(
        campaign_sections(shown, identified, memory, failed),
        (
            _results(processed / f.name, verdicts[f.name], identified[f.name])
            for f in sorted(reports, key=_name)
        ),
        links,
    ).encode(errors="replace")
    write_atomically(out / "summary.html", lambda stream: stream.write(page))


def _name(folder: Path) -> str:
    return folder.name


def _results(processed: Path, verdict: JSON, identified: JSON) -> Results:
    """Read what the page shows of a batch; tables that are absent or empty are left out."""
    read = {n: read_table(p) for n in (*PAGE, *drawn_tables()) if (p := processed / f"{n}.parquet").exists()}
    tables = {name: table for name, table in read.items() if len(table)}
    loop = _json(processed / "loop.json")
    return Results(read_batch(processed), tables, identified, verdict, loop)


def _reason(log: Path) -> str:
    """Return what a stage said before it stopped: all of a message, the last line of anything else."""
    text = log.read_text(encoding="utf-8", errors="replace").strip() if log.is_file() else ""
    if not text:
        return f"was not run to its end; {log} does not say why"
    return f"{text.splitlines()[-1]} (all of it: {log})" if "Traceback" in text else text


def _record(processed: Path, verdict: JSON, identified: JSON) -> Record:
    batch = read_batch(processed)
    loop = _json(processed / "loop.json")
    return Record(batch.name, batch.manifest, batch.started, verdict, loop, identified)


def _json(path: Path) -> JSON:
    content: JSON = json.loads(path.read_text(encoding="utf-8"))
    return content
