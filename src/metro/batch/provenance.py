"""What a report was made from, as hashes: written beside it, and compared with what is there now.

``reports/<batch>/provenance.json`` names the raw files, the processed tables, the results, the code and the
settings of every stage, and the versions of the packages that it depends on: enough to make the report anew,
and to see whether anything changed since.
"""

from __future__ import annotations

import hashlib
import json
import platform
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Any, Literal

from metro import __version__
from metro.batch.writing import write_atomically
from metro.units import JSON

FILE = "provenance.json"
DISTRIBUTION = "metro-machining"
# The stages whose code and settings have a file of their own. In their results these would change with every
# edit, and re-run all that comes after a stage even where its results come out the same.
STAGES = ("ingest", "identify", "predict", "loop", "verdict")
MADE = ".made.json"
RESULTS = ("identified.json", "verdict.json", "report.pdf", "report.html")

Change = Literal["changed", "missing", "added"]


@dataclass(frozen=True)
class Difference:
    """One thing that is not as it was when the report was made.

    Attributes
    ----------
    kind : raw, cell, processed, result (files); code, settings, package (what a new run would be made with).
    name : the file, stage or package. change : what became of it.
    was, now : hash, version or settings; "" where it was, or is, not there.
    """

    kind: str
    name: str
    change: Change
    was: str
    now: str

    @property
    def in_files(self) -> bool:
        """Whether a file differs: the report is not that of the files as they are."""
        return self.kind in {"raw", "cell", "processed", "result"}


def record(processed: Path, reports: Path, settings: JSON, code: str) -> JSON:
    """Return what a report was made from, read from its files when it has just been written.

    Parameters
    ----------
    processed, reports : the batch's folders.
    settings, code : those of the report's own stage; the other stages wrote theirs beside their results.
    """
    return {
        "format": 1,
        "batch": processed.resolve().name,
        "metro": __version__,
        "python": platform.python_version(),
        "packages": packages(),
        "stages": stages(processed, settings, code),
        "raw": sources(processed),
        "processed": processed_hashes(processed),
        "results": hashes(reports, RESULTS),
    }


def stages(processed: Path, settings: JSON, code: str) -> dict[str, JSON]:
    """Return ``code`` and ``settings`` by stage, in their order; the report's own are given."""
    made = {stage: made_by(processed, stage) for stage in STAGES}
    made["report"] = {"code": code, "settings": settings}
    return {stage: one for stage, one in made.items() if one}


def sources(processed: Path) -> dict[str, str]:
    """Return SHA-256 by raw file, from the metadata of the table of runs, which names all of them."""
    hash_by_file: dict[str, str] = json.loads(
        _metadata(processed / "runs.parquet").get("metro.sources", "{}")
    )
    return dict(sorted(hash_by_file.items()))


def write_made(processed: Path, stage: str, settings: JSON, code: str) -> None:
    """Write which code and settings a stage ran with, once its results are there."""
    text = json.dumps({"code": code, "settings": settings}, sort_keys=True) + "\n"
    write_atomically(processed / f"{stage}{MADE}", lambda stream: stream.write(text.encode()))


def made_by(processed: Path, stage: str) -> JSON:
    """Return the ``code`` and ``settings`` that a stage last ran with; nothing where it has not run."""
    file = processed / f"{stage}{MADE}"
    made: JSON = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    return made


def processed_hashes(processed: Path) -> dict[str, str]:
    """Return SHA-256 by name of a batch's processed files, those left out that say what code they are of."""
    return hashes(processed, (path.name for path in processed.glob("*") if not path.name.endswith(MADE)))


def hashes(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """Return SHA-256 by name of the files of a folder that are there, those with a leading dot left out."""
    there = sorted(name for name in names if not name.startswith(".") and (folder / name).is_file())
    return {name: sha256(folder / name) for name in there}


def sha256(path: Path) -> str:
    """Return the SHA-256 of a file's content, 64 hexadecimal digits."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def packages() -> dict[str, str]:
    """Return the versions of the packages that the project directly depends on, as they are installed."""
    try:
        asked = [text for text in requires(DISTRIBUTION) or [] if "extra ==" not in text]
    except PackageNotFoundError:
        return {}
    names = sorted(match[0] for text in asked if (match := re.match(r"[\w.-]+", text)))
    return {name: version for name in names if (version := _version(name))}


def compare(kind: str, was: Mapping[str, str], now: Mapping[str, str]) -> list[Difference]:
    """Return what differs between two sets of named hashes, versions or settings."""
    differences = []
    for name in sorted({*was, *now}):
        if was.get(name) != now.get(name):
            change: Change = "added" if name not in was else "missing" if name not in now else "changed"
            differences.append(Difference(kind, name, change, was.get(name, ""), now.get(name, "")))
    return differences


def _metadata(path: Path) -> dict[str, str]:
    import pyarrow.parquet as pq

    if not path.is_file():
        return {}
    raw: dict[bytes, bytes] = pq.read_schema(path).metadata or {}
    return {key.decode(): value.decode() for key, value in raw.items() if key.startswith(b"metro.")}


def _version(name: str) -> Any:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
