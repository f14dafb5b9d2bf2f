"""``metro watch``: seconds from the last byte of a record to the line on it, by the length of the record."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from metro.batch.config import load_config
from metro.stages.identify import identify
from metro.stages.ingest import ingest
from virtual_cell.chips import Tool
from virtual_cell.dynamometer import Dynamometer
from virtual_cell.recipes.slot import ALUMINIUM, PLANS
from virtual_cell.session import Session, record_run
from virtual_cell.units import DEG, MM

ROOT = Path(__file__).parents[1]
NAME = "clean-slot"
SECONDS = (0.6, 30.0)  # of cut in a record, at 10 kHz
REPEATS = 3


def main() -> None:
    """Print a row for each length and format."""
    with tempfile.TemporaryDirectory() as place:
        root = Path(place)
        raw, processed, reports = (root / part / NAME for part in ("data/raw", "data/processed", "reports"))
        shutil.copytree(ROOT / "data/raw" / NAME, raw)
        ingest(raw, ROOT / "config/cells", processed, {}, "code")
        budget = load_config(ROOT / "config/config.yaml")["loop"]["model_form_budget"]
        identify(processed, {"model_form_budget": budget}, "code")
        reports.mkdir(parents=True)
        shutil.copy(processed / "identified.json", reports)
        (reports / "verdict.json").write_text(json.dumps({"observables": {}}))
        print(f"{'samples':>9} {'format':>8} {'MB':>6}   s from the last byte")
        for number, seconds in enumerate(SECONDS):
            table = _record(root / "made", seconds)
            for suffix in (".parquet", ".csv"):
                names = [f"n{number}{suffix[1]}{repeat}" for repeat in range(REPEATS)]
                _plan(raw, names, suffix)
                size, times = _timed(root, raw, names, suffix, table)
                took = ", ".join(f"{each:.2f}" for each in times)
                print(f"{len(table):9d} {suffix[1:]:>8} {size / 1e6:6.1f}   {took}")


def _record(folder: Path, seconds: float) -> pd.DataFrame:
    plan = next(plan for plan in PLANS if plan.condition == "slot-0.11")
    (folder / "force").mkdir(parents=True, exist_ok=True)
    session = Session(
        Tool(6.0 * MM, 30.0 * DEG, np.arange(3) * 120.0 * DEG),
        ALUMINIUM,
        Dynamometer(10000.0, "work", np.eye(3), noise=1.0),
    )
    long = replace(plan, full_s=seconds)
    file = record_run(session, long, folder, "r", metres=1.0, rng=np.random.default_rng(1))
    return pd.read_parquet(folder / file)


def _plan(raw: Path, names: list[str], suffix: str) -> None:
    with (raw / "runs.csv").open("a") as stream:
        for name in names:
            order = sum(1 for _ in (raw / "runs.csv").open()) + 1
            stream.write(f"{name},,,,{order},slot,6000,0.11,2,12,slot,0,60,force/{name}{suffix}\n")
            stream.flush()


def _timed(
    root: Path, raw: Path, names: list[str], suffix: str, table: pd.DataFrame
) -> tuple[int, list[float]]:
    """Drop the record in again and again, with other noise, and time the answer of a running watch."""
    call = [sys.executable, "-c", "from metro.cli import app; app()", "watch", NAME]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(call, cwd=root, stdout=subprocess.PIPE, text=True, env=environment)
    assert process.stdout is not None
    times, size = [], 0
    for line in process.stdout:
        if line.startswith("Watching"):
            break
    time.sleep(2.0)
    for number, name in enumerate(names):
        noisy = table.assign(fx_n=table["fx_n"] + 1e-3 * (number + 1))
        path = raw / f"force/{name}{suffix}"
        noisy.to_parquet(path) if suffix == ".parquet" else noisy.to_csv(path, index=False)
        start, size = time.monotonic(), path.stat().st_size
        for line in process.stdout:
            if f"force/{name}{suffix}" in line:
                times.append(time.monotonic() - start)
                assert "as predicted" in line, line
                break
    process.kill()
    process.wait()
    return size, times


if __name__ == "__main__":
    main()
