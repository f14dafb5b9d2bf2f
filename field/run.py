"""Bring sets in by the command line and run them by snakemake, as a user would."""

from __future__ import annotations

import csv
import io
import json
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from field.taking import FieldSet
from metro.units import JSON

ROOT = Path(__file__).parents[1]
MOST = 400  # characters of a reason
METRO = Path(sys.executable).parent / "metro"


@dataclass(frozen=True)
class Result:
    """What became of a set.

    Attributes
    ----------
    questions : that were answered. seconds : of the import and of the stages up to the report.
    refusal : why it was not brought in, or has no report. found : its ``identified`` and ``verdict``.
    """

    set: FieldSet
    questions: int
    seconds: float
    refusal: str = ""
    found: dict[str, JSON] | None = None

    @property
    def wrong(self) -> bool:
        """Whether it ended otherwise than it should: in a report, or in the refusal that is right."""
        if self.set.refused:
            return self.set.refused not in self.refusal
        return self.found is None


def compared(sets: Sequence[FieldSet], data: Path, out: Path) -> list[Result]:
    """Bring the sets in, run all that were, and read what was found."""
    shutil.rmtree(out, ignore_errors=True)
    (out / "data/raw").mkdir(parents=True)
    shutil.copytree(ROOT / "config", out / "config")
    results = [_brought_in(one, data, out) for one in sets]
    started = time.perf_counter()
    _snakemake(out)
    each = (time.perf_counter() - started) / max(1, sum(not result.refusal for result in results))
    return [_read(replace(result, seconds=result.seconds + each), out) for result in results]


def _brought_in(one: FieldSet, data: Path, out: Path) -> Result:
    folder = data / (one.folder or f"field/{one.name}")
    if not one.files:
        shutil.copytree(folder, out / "data/raw" / one.name)
        return Result(one, 0, 0.0)
    files = [str(path) for pattern in one.files for path in sorted(folder.glob(pattern))]
    started = time.perf_counter()
    call = [str(METRO), "import", *files, "--out", str(out / "data/raw" / one.name), *one.answers]
    done = subprocess.run(call, capture_output=True, text=True, check=False)
    refusal = _reason(done.stdout + done.stderr, out) if done.returncode else ""
    if done.returncode:  # what is written and does not pass its check would stop the others
        shutil.rmtree(out / "data/raw" / one.name, ignore_errors=True)
    return Result(one, len(one.answers), time.perf_counter() - started, refusal)


def _reason(said: str, out: Path) -> str:
    """Return the first error of what was said, or what was not used of the files, in one line."""
    found = re.search(
        r"^(?:error|not used)[:\s]+(.*?)(?=\n\n|\nerror|\nnote|\nwarning|\Z)", said, re.M | re.S
    )
    text = found[1] if found else said[-MOST:]
    return " ".join(text.replace(f"{out}/", "").split())[:MOST]


def _snakemake(out: Path) -> None:
    snakemake = Path(sys.executable).parent / "snakemake"
    profile = ROOT / "profiles/default"
    call = [str(snakemake), "-s", str(ROOT / "Snakefile"), "--workflow-profile", str(profile), "-d", str(out)]
    with (out / "snakemake.log").open("w") as log:
        subprocess.run(call, stdout=log, stderr=subprocess.STDOUT, check=False)


def _read(result: Result, out: Path) -> Result:
    reports = out / "reports" / result.set.name
    if result.refusal or not (reports / "report.pdf").is_file():
        return replace(result, refusal=result.refusal or "no report was written: see snakemake.log")
    found: dict[str, Any] = {
        name: json.loads((reports / f"{name}.json").read_text()) for name in ("identified", "verdict")
    }
    tables = out / "data/raw" / result.set.name / "published.csv"
    with tables.open(newline="") if tables.is_file() else io.StringIO() as lines:
        found["printed"] = list(csv.DictReader(lines))
    return replace(result, found=found)
