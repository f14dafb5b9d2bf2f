"""Ingest: the raw files of a batch become canonical tables, in the axes, signs and units of the contract."""

from __future__ import annotations

import hashlib
import json
import math
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pandas as pd

from metro.batch.batch import Batch
from metro.batch.canonical import Part, write_parts
from metro.batch.check import HOLDOUT, Loaded, load
from metro.batch.files import OWN_TO_A_RUN
from metro.batch.findings import BatchError, Finding
from metro.batch.processed import COLUMNS, write_batch
from metro.batch.writing import writing
from metro.stages import recordings as parts
from metro.stages import scans
from metro.stages.reading import Recordings
from metro.units import JSON

# Canonical table → the columns of runs.csv that name its files.
RUN_FILES = {
    "force": ("dynamometer",),
    "robot": ("robot_log", "idle_log"),
    "path": ("path",),
    "scan": ("scan",),
    "profile": ("profile",),
}

DESCRIPTION = {"batch", "cell", "runs", "impacts", "loads", "mass", "stations", "published"}


def ingest(folder: Path, cells: Path, out: Path, settings: JSON, code: str) -> None:
    """Check a batch, read all its files, and write the canonical tables and what describes the batch.

    Parameters
    ----------
    folder : the batch, ``data/raw/<batch>``.
    cells : folder of the shared cells.
    out : ``data/processed/<batch>``.
    settings : with the section ``holdout`` of the configuration, where it is given.
    code : hash of the stage's code, for the provenance.

    Raises
    ------
    BatchError
        With every problem of the contract, or else of the data files; nothing is written then.
    """
    loaded = load(folder, cells, settings.get("holdout", HOLDOUT))
    named, described = _named_files(loaded), _description(folder)
    used = {file for files in named.values() for file in files} | set(described.values())
    sources = {file: _sha256(folder / file) for file in sorted(used)}
    with _progress(sum(map(len, named.values()))) as advance, _staging(out) as staging:
        recordings = Recordings(folder, advance)
        recordings.findings += _of_the_check(loaded)
        for table, content in _tables(loaded, recordings):
            files = named.get(table, [described[table]] if table in described else [])
            own = {file: sources[file] for file in files}
            write_parts(staging / f"{table}.parquet", table, content, _provenance(code, own))
        recordings.problems += _copies(named, loaded, sources)
        if recordings.problems:
            raise BatchError(recordings.problems)
        made = {**_provenance(code, sources), "settings": json.dumps(settings, sort_keys=True)}
        write_batch(staging, _without(loaded.batch, recordings.left_out), made)


def _provenance(code: str, sources: Mapping[str, str]) -> dict[str, str]:
    return {"code": code, "sources": json.dumps(sources)}


def _of_the_check(loaded: Loaded) -> list[dict[str, object]]:
    """Return what the check had to say, short of errors, as rows of the quality table."""
    rows = []
    for finding in loaded.findings:
        message = ": ".join(part for part in (finding.place, finding.message) if part)
        row = {
            "file": finding.file,
            "run": finding.run,
            "check": "contract",
            "value": math.nan,
            "limit": math.nan,
        }
        rows.append({**row, "ok": finding.severity == "note", "message": message})
    return rows


def _tables(loaded: Loaded, recordings: Recordings) -> Iterator[tuple[str, Iterable[Part]]]:
    """Yield every canonical table with its parts; force comes first, it sets each run's zero of time."""
    batch = loaded.batch
    yield "force", parts.force(batch, recordings)
    yield "robot", parts.robot(batch, recordings)
    yield "path", parts.path(batch, recordings)
    yield "scan", scans.scan(batch, recordings)
    yield "profile", parts.profile(batch, recordings)
    yield "hit", parts.hit(batch, loaded.impacts, recordings)
    yield "frf", parts.frf(loaded.impacts, recordings)
    for name in ("loads", "mass", "stations", "published"):
        yield name, _whole(getattr(loaded, name))
    yield "qc", _whole(pd.DataFrame(recordings.findings, columns=COLUMNS["qc"]))


def _named_files(loaded: Loaded) -> dict[str, list[str]]:
    """Return the files that each table of recordings is read from."""
    runs, impacts = loaded.batch.runs, loaded.impacts
    is_record = impacts["kind"] == "record"
    named = {"hit": list(impacts["file"][is_record]), "frf": list(impacts["file"][~is_record])}
    for table, columns in RUN_FILES.items():
        named[table] = [str(file) for column in columns for file in runs[column] if file]
    return named


def _copies(named: Mapping[str, list[str]], loaded: Loaded, sources: Mapping[str, str]) -> list[Finding]:
    """Find recordings of a run that are, byte for byte, those of another file."""
    own = [file for column in OWN_TO_A_RUN for file in loaded.batch.runs[column] if file]
    first: dict[str, str] = {}
    found = []
    for file in dict.fromkeys([*own, *named["hit"]]):
        other = first.setdefault(sources[file], file)
        if other != file:
            message = f"has the same content as {other}, expected a recording of its own: which was copied?"
            found.append(Finding("error", file, message))
    return found


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
def _staging(out: Path) -> Iterator[Path]:
    """Give a folder beside ``out`` to write into; if all went well its files move there, batch.json last."""
    with writing(out):
        out.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=f".{out.name}.", dir=out.parent))
        try:
            yield staging
            out.mkdir(exist_ok=True)
            # That of an earlier call does not describe these tables.
            (out / "batch.json").unlink(missing_ok=True)
            for file in sorted(staging.iterdir(), key=lambda file: file.name == "batch.json"):
                file.replace(out / file.name)
        finally:
            shutil.rmtree(staging)


@contextmanager
def _progress(files: int) -> Iterator[Callable[[], None]]:
    """Show on a terminal how many files have been read; give the function that counts one."""
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), disable=not sys.stderr.isatty(), transient=True) as progress:
        task = progress.add_task("reading", total=files)
        yield lambda: progress.advance(task)
