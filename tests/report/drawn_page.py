"""A page of two batches with curves, a boundary, responses, faces, and a title that would be a script."""

import json

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import write_batch, write_json, write_table
from metro.stages.campaign import campaign

EVIL = "<script>document.title = 'taken'</script>"
RUNS = pd.DataFrame(
    {
        "run": ["r1", "r2", "c1", "c2"],
        "condition": ["a", "b", "c", "d"],
        "operation": "slot",
        "role": "validate",
        "spindle_rpm": [1000.0, 1000.0, 1000.0, 1200.0],
        "axial_depth_mm": [1.0, 1.0, 1.0, 3.0],
        "feed_per_tooth_mm": 0.05,
        "pose": ["1"] * 4,
    }
)
TOOL = {"diameter_mm": 12.0, "teeth": 3, "helix_deg": 30.0}
BLANK = dict.fromkeys(("t_s", "angle_deg", "s_mm", "x_mm", "y_mm"), np.nan)


def _comparison():
    angle = np.arange(0, 360, 3.0)
    wave = 100 * np.sin(np.deg2rad(angle))
    force = [
        {**BLANK, "observable": "force", "run": run, "axis": axis, "t_s": 0.5, "unit": "N", "sigma": 1.0,
         "angle_deg": a, "measured": w, "before": w + 12.0, "after": w + 1.0}
        for run in ("r1", "r2") for axis in "xy" for a, w in zip(angle, wave, strict=True)
    ]  # fmt: skip
    cuts = [
        {**BLANK, "observable": "lobes", "run": run, "axis": None, "unit": "1", "sigma": np.nan,
         "measured": m, "before": 0.5, "after": m}
        for run, m in (("c1", 0.0), ("c2", 1.0))
    ]  # fmt: skip
    face = [
        {**BLANK, "observable": "flatness", "run": "r1", "axis": "z", "unit": "mm", "sigma": 0.01,
         "s_mm": 50.0 * j + x, "x_mm": x, "y_mm": 5.0 * j, "measured": 0.001 * x,
         "before": 0.0, "after": 0.0009 * x}
        for j in range(4) for x in np.arange(0.0, 50.0, 5.0)
    ]  # fmt: skip
    return pd.DataFrame([*force, *cuts, *face])


def _printed():
    """Return three forces of a printed table, and a wall along which a stretch was not measured."""
    printed = [
        {**BLANK, "observable": "force", "run": "table 7, test 2", "axis": axis, "unit": "N", "sigma": 1.0,
         "measured": m, "before": m + 20.0, "after": m + 20.0}
        for axis, m in zip("xyz", (78.0, -176.0, -35.0), strict=True)
    ]  # fmt: skip
    wall = [
        {**BLANK, "observable": "waviness", "run": run, "axis": "z", "unit": "um", "sigma": 0.3,
         "s_mm": s, "measured": np.sin(s), "before": np.sin(s) + much, "after": np.sin(s) + 0.1}
        for run, much in (("w1", 0.2), ("w2", 0.8)) for s in (*np.arange(40.0), *np.arange(80.0, 120.0))
    ]  # fmt: skip
    return pd.DataFrame([*printed, *wall])


def _responses():
    hz = np.arange(50.0, 250.0)
    exact = 1e-8 / (1 - (hz / 120.0) ** 2 + 0.04j * hz / 120.0)
    pairs = []
    for response, share in (("1x", 0.5), ("2x", 1.0)):
        both = {"real_m_n": share * exact.real, "imag_m_n": share * exact.imag}
        both |= {f"modal_{name}": 1.01 * value for name, value in both.items()}
        place = {"position": "1", "reference": "1x", "response": response, "frequency_hz": hz}
        pairs.append(pd.DataFrame({**place, **both, "error": 0.01}))
    return pd.concat(pairs)


def _lobes(depth):
    """Return a boundary that is the same at all speeds but one, where it is far above the others."""
    rpm = np.arange(1000.0, 2001.0, 50.0)
    depth = np.where(rpm == 1800.0, 10.0 * depth, depth)
    table = pd.DataFrame({"position": 1, "rpm": rpm, "depth_mm": depth, "kind": "hopf", "chatter_hz": 88.0})
    table = table.assign(depth_lo_mm=0.9 * depth, depth_hi_mm=1.1 * depth, interpolated=False)
    return table.assign(operation="slot", direction="slot", radial_depth_mm=12.0)


def _face():
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(20.0), np.arange(12.0)))
    first = pd.DataFrame({"run": "r1", "x_mm": x, "y_mm": y, "deviation_um": 10 * np.sin(x / 3) - y})
    return pd.concat([first, first.assign(run="r2", deviation_um=first["deviation_um"] / 4)])


def _error(rms):
    return {"rms": rms, "nrmse": rms / 100, "ci95": [0.9 * rms, 1.1 * rms]}


def _identified(name, ktc):
    """Return coefficients of which one differs between batches by more than its interval."""
    known = {"ktc": ktc, "krc": 300.0, "kac": 150.0, "kte": 14.0, "kre": 18.0, "kae": 4.0}
    waveform = {
        key: {
            "value": value,
            "ci95": [value - 5.0, value + 5.0],
            "unit": "N/mm2" if key[-1] == "c" else "N/mm",
        }
        for key, value in known.items()
    }
    correlation = {"coefficients": list(known), "matrix": np.eye(len(known)).tolist()}
    return {"format": 1, "batch": name, "force": {"waveform": waveform, "correlation": correlation}}


def _entry(unit, status="explained"):
    runout = {"value": 9.8, "ci95": [9.3, 10.3], "unit": "um"}
    effect = {"effect": "tool_runout", "probability": 0.99, "parameters": {"radius_um": runout}}
    return {
        "status": status, "unit": unit, "noise_floor": 1.9, "held_out_runs": ["r1", "r2"],
        "before": _error(11.8), "after": _error(2.1), "effects": [effect], "candidates": [],
        "indistinguishable": [], "next_experiment": "a slot at twice the feed", "unexplained": None,
    }  # fmt: skip


def written_page(root):
    """Write the summary of two batches under ``root``; return the page."""
    tables = {
        "comparison": _comparison(),
        "lobes": _lobes(1.5),
        "lobes_final": _lobes(2.0),
        "face_map": _face(),
    }
    units = {"force": "N", "flatness": "mm", "lobes": "1"}
    others = {"comparison": _printed(), "frf_used": _responses()}
    titles = {
        "early": (EVIL, others, {"force": "N", "waviness": "um"}),
        "late": ("Slots & <b>faces</b>", tables, units),
    }
    for name, (title, frames, observables) in titles.items():
        processed, reports = root / "processed" / name, root / "reports" / name
        batch = Batch(name, {"title": title, "cell": "c", "source": "measured", "tool": TOOL}, {"cell": "c"},
                      RUNS.set_index("run"), {})  # fmt: skip
        write_batch(processed, batch, {})
        (processed / "loop.json").write_text(json.dumps({"observables": {}}))
        for table, frame in frames.items():
            write_table(processed / f"{table}.parquet", frame, {})
        verdicts = {observable: _entry(unit) for observable, unit in observables.items()}
        if "waviness" in verdicts:
            verdicts["waviness"] = _entry("um", "unexplained")
        write_json(reports / "verdict.json", {"format": 1, "batch": name, "observables": verdicts})
        write_json(reports / "identified.json", _identified(name, 850.0 if name == "early" else 900.0))
        write_json(reports / "provenance.json", {"format": 1})
        (reports / "report.pdf").write_bytes(b"%PDF-1.7")
    folders = [root / "reports" / name for name in titles]
    campaign(folders, root / "processed", root / "reports", {}, "c0de")
    return root / "reports" / "summary.html"
