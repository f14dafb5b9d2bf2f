"""Two small batches as the stages leave them: tables, results, and the raw files that they come from."""

import hashlib
import json
from pathlib import Path

import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import write_batch, write_json, write_table
from metro.batch.provenance import FILE, STAGES, record, write_made

CELL = {"cell": "bench"}


def q(value, half, unit):
    return {"value": value, "ci95": [value - half, value + half], "unit": unit}


def error(rms):
    return {"rms": rms, "nrmse": rms / 100, "ci95": [0.9 * rms, 1.1 * rms]}


def candidate(effect, probability, gain, p, why):
    tried = {"effect": effect, "probability": probability, "held_out_gain": gain, "p_value": p}
    return {**tried, "why_not": why}


def entry(status, before, after, effects=(), **more):
    return {
        "status": status,
        "unit": "N",
        "noise_floor": 1.9,
        "held_out_runs": ["r1", "r2"],
        "before": error(before),
        "after": error(after),
        "effects": list(effects),
        "candidates": [
            candidate("tool_wear", 0.004, 1.2, 0.03, "no gain"),
            candidate("pitch_error", 0.0, 0, 0.8, "no evidence"),
        ],
        "indistinguishable": [],
        "next_experiment": "a slot at twice the feed",
        "unexplained": None,
        **more,
    }  # fmt: skip


def runout(radius):
    return {
        "effect": "tool_runout",
        "probability": 0.99,
        "parameters": {
            "radius_um": q(radius, 0.5, "um"),
            "pitch_deg": [q(1.0, 0.1, "deg"), q(-1.0, 0.1, "deg")],
        },
    }


def write_small_batch(root, name, ktc, tables, *, effects=(), status="clean"):
    """Write the raw folder, tables, results and provenance of a batch under ``root``."""
    raw, processed, reports = (root / part / name for part in ("data/raw", "data/processed", "reports"))
    (raw / "force").mkdir(parents=True)
    manifest = {
        "title": f"Batch {name}",
        "source": "measured",
        "cell": "bench",
        "tool": {"diameter_mm": 12, "teeth": 3},
    }
    (raw / "batch.yaml").write_text(f"batch: {name}\ncell: bench\n")
    (raw / "force/r1.csv").write_text(f"t_s,fx_n\n0,{ktc}\n")
    files = ("batch.yaml", "force/r1.csv")
    sources = {file: hashlib.sha256((raw / file).read_bytes()).hexdigest() for file in files}
    runs = pd.DataFrame(
        {"run": ["r1", "r2"], "condition": ["a", "b"], "operation": "slot", "role": "validate"}
    )
    runs = runs.assign(dynamometer=["force/r1.csv", ""], direction="slot", order=[1, 2])
    batch = Batch(
        name,
        manifest,
        CELL,
        runs.set_index("run"),
        {"identify": [], "validate": ["r1", "r2"], "how": "given"},
    )
    write_batch(processed, batch, {"sources": json.dumps(sources)})
    needed = {
        "modes": pd.DataFrame(),
        "prediction": pd.DataFrame({"run": ["r1"]}),
        "comparison": pd.DataFrame({"run": ["r1"]}),
    }
    for table, frame in {**needed, **tables}.items():
        write_table(processed / f"{table}.parquet", frame)
    write_json(processed / "loop.json", {"format": 1, "batch": name, "observables": {}})
    for stage in STAGES:
        write_made(processed, stage, {}, "c0de")
    write_json(
        reports / "identified.json",
        {"format": 1, "batch": name, "force": {"mean": {"ktc": q(ktc, 5.0, "N/mm2")}}},
    )
    verdict = entry(status, 11.8, 2.1 if effects else 11.8, effects)
    write_json(reports / "verdict.json", {"format": 1, "batch": name, "observables": {"force": verdict}})
    (reports / "report.pdf").write_bytes(b"%PDF-1.7 " + name.encode())
    write_json(reports / FILE, record(processed, reports, {}, "c0de"))
    return Path(raw), processed, reports


def write_campaign(root):
    """Write two batches whose tables differ in columns and types, as those of two versions do."""
    early = pd.DataFrame({"run": ["r1"], "index": [1], "value": [3]})
    late = pd.DataFrame({"run": ["r1", "r2"], "value": [2.5, 4.5], "sigma": [0.1, 0.2]})
    empty = pd.DataFrame(
        {"run": pd.Series([None], dtype=object), "value": pd.Series([None], dtype=object)}
    ).iloc[:0]
    write_small_batch(root, "early", 900.0, {"grown": early, "absent": pd.DataFrame(), "untyped": empty})
    full = pd.DataFrame({"run": ["r1"], "value": [7.5]})
    tables = {"grown": late, "absent": late, "untyped": full}
    write_small_batch(root, "late", 950.0, tables, effects=[runout(9.8)], status="explained")
    return root
