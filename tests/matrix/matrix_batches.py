"""The batches that the matrix takes apart: every bundled and real one, made small, and some made by hand."""

import os
import shutil
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import matrix_made
import pandas as pd

ROOT = Path(__file__).parents[2]
REAL = Path(os.environ.get("METRO_REAL_DATA", ROOT / "../shared/real"))
FILES = ("dynamometer", "robot_log", "idle_log", "path", "scan", "profile")
KEPT = {"identify": 3, "validate": 1}  # runs of a small copy, by their role
SAMPLES = 6000  # of a force record


@dataclass(frozen=True)
class Source:
    """A batch to take apart, small already; ``folder`` has the batch's name."""

    name: str
    folder: Path


def sources(place, names=()):
    """Write a small copy of every batch, or of those that are named, below ``place``; return them."""
    folders = sorted(path.parent for path in ROOT.glob("data/raw/*/batch.yaml"))
    folders += sorted(path.parent for path in REAL.glob("batches/*/batch.yaml"))
    writers = {folder.name: partial(small_copy, folder) for folder in folders} | matrix_made.WRITERS
    for name, write in writers.items():
        if not names or name in names:
            write(place / name)
    return [Source(folder.name, folder) for folder in sorted(place.iterdir()) if folder.is_dir()]


def small_copy(folder, to):
    """Copy a batch with few of its runs, of which every force record is short."""
    shutil.copytree(folder, to)
    table = to / "runs.csv"
    if not table.exists():
        return
    runs = pd.read_csv(table, dtype=str, keep_default_na=False)
    if "role" in runs and runs["role"].ne("").any():
        few = [runs[runs["role"] == role].head(count) for role, count in KEPT.items()]
        runs = pd.concat(few).sort_index()
        runs.to_csv(table, index=False)
    named = {file for column in FILES if column in runs for file in runs[column] if file}
    if (to / "impacts.csv").exists():
        impacts = pd.read_csv(to / "impacts.csv", dtype=str, keep_default_na=False)
        named |= {file.partition("#")[0] for file in impacts["file"]}
    for path in [path for path in to.rglob("*") if path.is_file() and path.parent != to]:
        if str(path.relative_to(to)) not in named:
            path.unlink()
    for file in {file for file in runs.get("dynamometer", []) if file}:
        _shorten(to / file)


def _shorten(path):
    if path.suffix == ".parquet":
        pd.read_parquet(path).head(SAMPLES).to_parquet(path, index=False)
    else:
        lines = path.read_text().splitlines(keepends=True)
        path.write_text("".join(lines[: SAMPLES + 1]))
