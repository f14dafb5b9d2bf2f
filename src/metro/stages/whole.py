"""A batch read wholly: every file becomes canonical tables, and what is wrong with any of it is gathered.

``metro check`` and ingest are this one code. Ingest keeps the tables, the check removes them: so the check
accepts what ingest accepts, refuses what it refuses, and says what can be computed from the files that remain
after recordings that are not fit for use were left out.
"""

from __future__ import annotations

import hashlib
import json
import math
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd

from metro.batch.batch import Batch
from metro.batch.canonical import Part, write_parts
from metro.batch.capabilities import Stock, nothing_computed
from metro.batch.cell import CELLS
from metro.batch.check import HOLDOUT, CheckReport, Examined, Loaded, examine
from metro.batch.columns import OWN_TO_A_RUN
from metro.batch.findings import Finding, errors
from metro.batch.processed import COLUMNS, Processed, Tables
from metro.batch.sources import SECTION, files_of, parted
from metro.observables.catalogue import capabilities
from metro.signals.quality import EXTENT
from metro.stages import joint_logs, robot_logs, scans
from metro.stages import recordings as parts
from metro.stages.data_checks import data_findings
from metro.stages.reading import LEFT_OUT, MUST_PASS, Recordings
from metro.units import JSON

# Canonical table → the columns of runs.csv that name its files.
RUN_FILES = {
    "force": ("dynamometer",),
    "robot": ("robot_log", "idle_log"),
    "joint": ("joint_log",),
    "path": ("path",),
    "scan": ("scan",),
    "profile": ("profile",),
    "slopes": ("slopes",),
    "poses": ("poses",),
    "targets": ("targets",),
}

OF_THE_TABLES = "contract"  # the check, in the quality table, that findings on the batch's tables are of
DESCRIPTION = {
    "batch",
    "cell",
    "runs",
    "impacts",
    "loads",
    "mass",
    "touches",
    "payload",
    "stations",
    "published",
}


@dataclass(frozen=True)
class Whole:
    """A batch whose files were all read.

    Attributes
    ----------
    batch : as though recordings that are not fit for use had not been made.
    stock : the files and tables that remain, to compute from.
    sources : SHA-256 by file that the tables were made from.
    findings : what is wrong with the files, or with the data as a whole; an error refuses the batch.
    """

    batch: Batch
    stock: Stock
    sources: Mapping[str, str]
    findings: tuple[Finding, ...]


def check_whole(
    folder: Path,
    cells: Path = CELLS,
    holdout: JSON = HOLDOUT,
    *,
    quick: bool = False,
    also: Callable[[Batch, Tables], Iterable[Finding]] | None = None,
) -> CheckReport:
    """Check a batch as ingest does, and write nothing that stays.

    The tables that the data are looked at in are made in a temporary folder. Where the batch's own tables
    have errors, the files are not read: what they hold depends on what the tables say.

    Parameters
    ----------
    folder, cells, holdout : as :func:`metro.batch.check.check`.
    quick : whether to look at the tables and the heads of the files alone, which takes seconds.
    also : looks at the data for what ingest need not know, where nothing is an error
        (:func:`metro.stages.contradictions.contradictions`).
    """
    examined = examine(folder, cells, holdout)
    report = examined.report(capabilities)
    if quick or not report.ok:
        return report
    with tempfile.TemporaryDirectory(prefix="metro-check-") as place:
        read = read_whole(examined, Path(place))
        looked = also is not None and not errors(read.findings)
        more = also(read.batch, Processed(Path(place))) if also and looked else ()
        problems = (*report.problems, *read.findings, *more)
    return replace(report, capabilities=capabilities(read.stock), problems=problems)


def read_whole(examined: Examined, place: Path) -> Whole:
    """Read all files of a batch, one at a time and large ones in pieces, into canonical tables.

    Parameters
    ----------
    examined : the batch's tables.
    place : folder that the canonical tables are written to.

    Raises
    ------
    BatchError
        With every error of the batch's tables: then its files are not read.
    """
    folder, loaded = examined.folder, examined.loaded()
    named, described = _named_files(loaded), _description(folder)
    mappings = loaded.batch.manifest.get(SECTION) or {}
    read = {name: files_of(folder, name, mappings) for names in named.values() for name in names}
    used = {file for files in read.values() for file in files} | set(described.values())
    sources = {file: _sha256(folder / file) for file in sorted(used)}
    with _progress(folder.name, sum(map(len, named.values()))) as advance:
        recordings = Recordings(folder, advance, mappings)
        recordings.findings += _of_the_check(loaded)
        for table, content in _tables(loaded, recordings):
            files = named.get(table, [described[table]] if table in described else [])
            own = {file: sources[file] for name in files for file in read.get(name, [name])}
            write_parts(place / f"{table}.parquet", table, content, provenance_of(own))
    batch = _without(loaded.batch, recordings.left_out)
    stock = _stock(examined.stock, batch, recordings)
    problems = [
        *recordings.problems,
        *_copies(named, loaded, _contents(folder, read, sources)),
        *_doubts(recordings),
    ]
    if not errors(problems):
        problems += nothing_computed(capabilities(stock), _unfit(recordings))
        problems += data_findings(batch, Processed(place))
    return Whole(batch, stock, sources, tuple(problems))


def _stock(before: Stock, batch: Batch, recordings: Recordings) -> Stock:
    """Return what remains of what the tables list."""
    impacts = before.tables["impacts"]
    impacts = impacts[impacts["file"].isin(recordings.usable)]
    runs = batch.runs.reset_index()
    return Stock(batch.manifest, batch.cell, runs, {**before.tables, "impacts": impacts})


def _doubts(recordings: Recordings) -> list[Finding]:
    """Return what the quality table holds that somebody should look at, the check of the tables aside.

    The size of a scan, which shows whether its unit is right, is a note.
    """
    return [
        Finding(
            "note" if row["ok"] else "warning", str(row["file"]), str(row["message"]), run=str(row["run"])
        )
        for row in recordings.findings
        if (not row["ok"] or row["check"] == EXTENT) and row["check"] != OF_THE_TABLES
    ]


def _unfit(recordings: Recordings) -> list[str]:
    """Return why recordings are not fit for use, each with its file."""
    rows = [row for row in recordings.findings if not row["ok"] and row["check"] in MUST_PASS]
    return [f"{row['file']}: {str(row['message']).removesuffix(LEFT_OUT)}" for row in rows]


def provenance_of(sources: Mapping[str, str]) -> dict[str, str]:
    """Return the metadata of a table that was made from these files."""
    return {"sources": json.dumps(sources)}


def _of_the_check(loaded: Loaded) -> list[dict[str, object]]:
    """Return what the check had to say, short of errors, as rows of the quality table."""
    rows = []
    for finding in loaded.findings:
        message = ": ".join(part for part in (finding.place, finding.message) if part)
        row = {
            "file": finding.file,
            "run": finding.run,
            "check": OF_THE_TABLES,
            "value": math.nan,
            "limit": math.nan,
        }
        rows.append({**row, "ok": finding.severity == "note", "message": message})
    return rows


def _tables(loaded: Loaded, recordings: Recordings) -> Iterator[tuple[str, Iterable[Part]]]:
    """Yield every canonical table with its parts; force comes first, it sets each run's zero of time."""
    batch = loaded.batch
    yield "force", parts.force(batch, recordings)
    yield "robot", robot_logs.robot(batch, recordings)
    yield "joint", joint_logs.joint(batch, recordings)
    yield "path", parts.path(batch, recordings)
    yield "scan", scans.scan(batch, recordings)
    yield "profile", parts.profile(batch, recordings)
    yield "slopes", parts.slopes(batch, recordings)
    yield "poses", parts.poses(batch, recordings)
    yield "targets", parts.targets(batch, recordings)
    yield "hit", parts.hit(batch, loaded.impacts, recordings)
    yield "frf", parts.frf(loaded.impacts, recordings)
    yield "pickups", _whole(_pickups(loaded.impacts))
    for name in ("loads", "mass", "touches", "payload", "stations", "published"):
        yield name, _whole(getattr(loaded, name))
    yield "qc", _whole(pd.DataFrame(recordings.findings, columns=COLUMNS["qc"]))


def _pickups(impacts: pd.DataFrame) -> pd.DataFrame:
    """Return how far from the blow each response was measured, where impacts.csv says so."""
    known = impacts[impacts["distance_mm"].notna()]
    return known[list(COLUMNS["pickups"])].drop_duplicates(["position", "reference", "response"])


def _named_files(loaded: Loaded) -> dict[str, list[str]]:
    """Return the files that each table of recordings is read from."""
    runs, impacts = loaded.batch.runs, loaded.impacts
    is_record = impacts["kind"] == "record"
    named = {"hit": list(impacts["file"][is_record]), "frf": list(impacts["file"][~is_record])}
    for table, columns in RUN_FILES.items():
        named[table] = [str(file) for column in columns for file in runs[column] if file]
    return named


def _contents(folder: Path, read: Mapping[str, list[str]], sources: Mapping[str, str]) -> dict[str, str]:
    """Return what distinguishes the data under each name: the content of its files, and the record."""
    return {
        name: " ".join((*(sources[file] for file in files), parted(folder, name)[1]))
        for name, files in read.items()
    }


def _copies(named: Mapping[str, list[str]], loaded: Loaded, contents: Mapping[str, str]) -> list[Finding]:
    """Find recordings of a run that are, byte for byte, those of another file."""
    own = [file for column in OWN_TO_A_RUN for file in loaded.batch.runs[column] if file]
    first: dict[str, str] = {}
    copies = []
    for file in dict.fromkeys([*own, *named["hit"]]):
        other = first.setdefault(contents[file], file)
        if other != file:
            message = f"has the same content as {other}, expected a recording of its own: which was copied?"
            copies.append(Finding("error", file, message))
    return copies


def _without(batch: Batch, left_out: list[tuple[str, str]]) -> Batch:
    """Return the batch as though recordings that are not fit for use had not been made."""
    runs = batch.runs.copy()
    for run, column in left_out:
        if run:
            runs.loc[run, column] = ""
    return replace(batch, runs=runs)


def _description(folder: Path) -> dict[str, str]:
    """Return the batch's own manifest, cell and tables by name."""
    files = (file for file in folder.iterdir() if file.suffix in {".yaml", ".csv", ".parquet"})
    return {file.stem: file.name for file in files if file.stem in DESCRIPTION}


def _whole(table: pd.DataFrame) -> Iterator[Part]:
    """Give a table that is in memory as one part, or as none where it has no rows."""
    if len(table):
        yield {str(name): table[name] for name in table}


def _sha256(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


@contextmanager
def _progress(batch: str, files: int) -> Iterator[Callable[[], None]]:
    """Show on a terminal how many files have been read; give the function that counts one."""
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), disable=not sys.stderr.isatty(), transient=True) as progress:
        task = progress.add_task(f"reading {batch}", total=files)
        yield lambda: progress.advance(task)
