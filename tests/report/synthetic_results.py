"""Results of a made-up batch with every observable, in the shapes of the contract."""

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.report.results import Results

COLUMNS = [
    *("observable", "run", "axis", "t_s", "angle_deg", "s_mm", "x_mm", "y_mm"),
    *("measured", "before", "after", "sigma", "unit"),
]


def q(value, half, unit):
    return {"value": value, "ci95": [value - half, value + half], "unit": unit}


def force_rows(runs=("r07", "r08"), blocks=4):
    rng = np.random.default_rng(1)
    angle = np.arange(0, 360, 3.0)
    parts = []
    for k, run in enumerate(runs):
        for block in range(blocks):
            for a, axis in enumerate("xyz"):
                truth = (60 + 30 * k) * np.sin(np.radians(4 * angle + 40 * a)) + 20 * a
                runout = 11 * np.sin(np.radians(angle + 30 * a))
                part = pd.DataFrame(
                    {"angle_deg": angle, "measured": truth + runout + rng.normal(0, 1.9, angle.size)}
                )
                part = part.assign(before=truth, after=truth + 0.95 * runout, sigma=1.9, unit="N")
                parts.append(part.assign(observable="force", run=run, axis=axis, t_s=0.5 * block))
    return pd.concat(parts)


def wall_rows():
    s = np.arange(0, 60, 1.0)
    shape = 0.2 * (1 - np.exp(-s / 8))
    frame = pd.DataFrame(
        {"s_mm": s, "measured": shape + 0.004 * np.sin(s), "before": 0.8 * shape, "after": shape}
    )
    return frame.assign(observable="deformation", run="r09", axis="z", sigma=0.002, unit="mm")


def face_rows():
    x, y = (g.ravel() for g in np.meshgrid(np.arange(5, 100, 5.0), np.arange(5, 60, 10.0)))
    bow = 0.05 * ((x - 50) / 50) ** 2
    frame = pd.DataFrame(
        {"x_mm": x, "y_mm": y, "s_mm": np.arange(x.size) * 5.0, "measured": bow - 0.02, "before": -0.02}
    )
    return frame.assign(after=bow - 0.021, observable="flatness", run="f1", axis="z", sigma=0.003, unit="mm")


def lobe_rows():
    frame = pd.DataFrame(
        {"run": ["r07", "r08"], "measured": [1.0, 0.0], "before": [0.93, 0.12], "after": [0.93, 0.12]}
    )
    return frame.assign(observable="lobes", unit="1")


def boundary():
    rpm = np.linspace(1000, 4000, 120)
    depth = 1 + 0.6 * np.abs(np.sin(rpm / 300))
    columns = {"depth_lo_mm": 0.8, "depth_p05_mm": 0.9, "depth_p95_mm": 1.1, "depth_hi_mm": 1.2}
    bands = {name: factor * depth for name, factor in columns.items()}
    kind = np.where(rpm > 3000, "flip", "hopf")
    rest = {"kind": kind, "error_mm": 1e-4 * depth, "interpolated": False}
    return pd.DataFrame({"position": "1", "rpm": rpm, "depth_mm": depth, **bands, **rest})


def methods():
    line = boundary().iloc[::6]
    depth = line["depth_mm"]
    other = {"cdsem_mm": 0.909, "single_mode_mm": 0.9, "semidiscretisation_mm": 1.0002, "tool_mm": 1.03}
    columns = {name: factor * depth for name, factor in other.items()}
    mode = np.where(line["rpm"] > 2000, "x4", "x3")
    return line[["position", "rpm", "depth_mm"]].assign(governing_mode=mode, checked=True, **columns)


def islands():
    return pd.DataFrame({"position": "1", "rpm": [1500.0, 1525.0], "from_mm": 1.7, "to_mm": 1.9})


def responses():
    f = np.linspace(10, 60, 200)
    h = 1 / (7.255e6 * (1 - (f / 21.365) ** 2 + 0.1218j * f / 21.365))
    frf = pd.DataFrame(
        {"position": "1", "reference": "1x", "response": "1x", "frequency_hz": f, "coherence": 1.0}
    )
    return frf.assign(real_m_n=h.real, imag_m_n=h.imag, modal_real_m_n=1.02 * h.real, modal_imag_m_n=h.imag)


def observable(status="explained", before=11.8, after=2.1, unit="N", **more):
    entry = {
        "status": status,
        "unit": unit,
        "noise_floor": 0.16 * before,
        "held_out_runs": ["r07", "r08"],
        "before": {"rms": before, "nrmse": 0.083, "ci95": [0.92 * before, 1.08 * before]},
        "after": {"rms": after, "nrmse": 0.083 * after / before, "ci95": [0.92 * after, 1.08 * after]},
        "effects": [],
        "candidates": [],
        "indistinguishable": [],
        "next_experiment": "",
        "unexplained": None,
    }
    return {**entry, **more}


RUNOUT = {
    "effect": "tool_runout",
    "probability": 0.99,
    "parameters": {"radius_um": q(9.83, 0.31, "um"), "angle_deg": q(41.2, 2.4, "deg")},
}


REST = {"rms": 0.03, "signature": "grows along the path"}


def verdict():
    return {
        "format": 1,
        "batch": "synthetic",
        "metro": "0",
        "observables": {
            "force": observable(effects=[RUNOUT]),
            "deformation": observable("unexplained", 0.034, 0.034, "mm", unexplained=REST),
            "flatness": observable(
                "undetermined", 0.02, 0.004, "mm", indistinguishable=[["fixture_bow", "thermal_growth"]],
                next_experiment="scan the face clamped and free",
            ),
            "lobes": observable("clean", 0.12, 0.12, "1"),
        },
    }  # fmt: skip


def told():
    tried = {
        "statistic": 1.2,
        "p_value": 0.31,
        "q_value": 0.5,
        "held_out_gain": -0.4,
        "size": 0.001,
        "weight": 0.0,
    }
    runout = {"p_value": 1e-9, "q_value": 1e-8, "held_out_gain": 210.0, "size": 0.08, "weight": 0.99}
    small = "changes the prediction by less than 0.4 % of the signal"
    candidates = [
        {**tried, **runout, "effect": "tool_runout", "verdict": "added", "why_not": "", "parameters": {}},
        {**tried, "effect": "tool_wear", "verdict": "rejected", "why_not": small},
        {
            **dict.fromkeys(tried),
            "effect": "dynamometer_rotation",
            "verdict": "not visible",
            "why_not": "absorbed",
        },
    ]
    blocks = [
        {"run": f"r0{i}", "condition": "a", "role": "validate" if i > 6 else "identify", "order": i,
         "rms_measured": 140.0, "rms_before": 11.5 + 0.2 * i, "rms_after": 2.0 + 0.05 * i,
         "chi2_before": 40.0, "chi2_after": 1.1}
        for i in range(1, 9)
    ]  # fmt: skip
    signature = [
        {
            "axis": axis,
            "label": f"order {k}",
            "amplitude": 0.3 / k,
            "significant": axis == "x" and k == 1,
            "p_value": 0.01,
        }
        for axis in "xyz"
        for k in range(1, 7)
    ]
    force = {
        "unit": "N",
        "notes": ["The spindle speed is estimated per run."],
        "noise": {"floor": 1.9, "budget": 0.007, "words": "From repeats of four conditions."},
        "candidates": candidates,
        "path": [
            {"added": [], "before_rms": 11.6, "held_out_rms": 11.8, "nrmse": 0.083},
            {"added": ["tool_runout"], "before_rms": 2.0, "held_out_rms": 2.1, "nrmse": 0.015},
        ],
        "signature": signature,
        "cannot_be_seen": [{"effect": "dynamometer_rotation", "why": "slots only: K_tc and K_rc absorb it"}],
        "blocks": blocks,
        "words": "Runout of the tool accounts for nearly all of the difference.",
    }
    return {"observables": {"force": force}}


def identified():
    six = {
        "ktc": (958.9, 6),
        "krc": (250.9, 4),
        "kac": (146.4, 3),
        "kte": (15.76, 0.4),
        "kre": (19.43, 0.3),
        "kae": (18.21, 0.2),
    }
    block = {k: q(v, h, "N/mm2" if k.endswith("c") else "N/mm") for k, (v, h) in six.items()}
    return {
        "format": 1,
        "force": {"mean": block, "waveform": block, "edge_length": "axial",
                  "spindle_rpm": {"r07": q(2001.3, 0.4, "rpm")}},
        "modes": [
            {"position": 1, "direction": "x", "frequency": q(21.365, 0.02, "Hz"),
             "damping": q(0.0609, 0.001, "1"),
             "stiffness": q(7.255e6, 4e4, "N/m"), "mass": q(402.6, 2.2, "kg")}
        ],
        "lobes": [{"position": 1, "boundary": "lobes.parquet", "lowest_mm": q(1.02, 0.05, "mm")}],
        "arm": {"joint_stiffness": [q(2e6 / i, 3e4, "N m/rad") for i in range(1, 7)],
                "tip_force": {"r09": {a: q(46.1, 1.2, "N") for a in "xyz"}}},
        "faces": {"f1": {"xm": q(160.2, 4.0, "um"), "xa": q(31.0, 0.6, "um"), "points": 350000}},
        "not_identified": {"tip": "no impacts.csv"},
    }  # fmt: skip


def tables():
    x, y = (g.ravel() for g in np.meshgrid(np.linspace(0, 100, 30), np.linspace(0, 60, 18)))
    comparison = pd.concat([force_rows(), wall_rows(), face_rows(), lobe_rows()], ignore_index=True).reindex(
        columns=COLUMNS
    )
    qc = pd.DataFrame(
        [
            {
                "file": "r07.csv",
                "run": "r07",
                "check": "clipping",
                "value": 0.0,
                "limit": 0.0,
                "ok": True,
                "message": "",
            },
            {
                "file": "r08.csv",
                "run": "r08",
                "check": "gaps",
                "value": 3.0,
                "limit": 0.0,
                "ok": False,
                "message": "3 samples missing",
            },
        ]
    )
    face_map = pd.DataFrame(
        {"run": "f1", "x_mm": x, "y_mm": y, "deviation_um": 50 * ((x - 50) / 50) ** 2 - 17}
    )
    return {
        "qc": qc,
        "comparison": comparison,
        "lobes_final": boundary(),
        "lobe_methods": methods(),
        "lobe_islands": islands(),
        "face_map": face_map,
        "frf_used": responses(),
    }


def batch():
    ids = [f"r0{i}" for i in range(1, 10)] + ["f1"]
    runs = pd.DataFrame(
        {
            "role": ["identify"] * 6 + ["validate"] * 4, "operation": ["slot"] * 9 + ["face"], "pose": "1",
            "order": range(1, 11), "dynamometer": "",
            "spindle_rpm": np.linspace(1200, 3900, 10), "axial_depth_mm": np.linspace(0.4, 1.9, 10),
        },
        index=pd.Index(ids, name="run"),
    )  # fmt: skip
    manifest = {
        "batch": "synthetic", "title": "A batch of every kind", "source": "simulated", "cell": "kr160",
        "tool": {"diameter_mm": 16, "teeth": 4}, "work": {"material": "AA6061-T6"},
    }  # fmt: skip
    plan = {"identify": ids[:6], "validate": ids[6:], "how": "from the column role of runs.csv", "seed": 1}
    return Batch("synthetic", manifest, {"cell": "kr160"}, runs, plan)


STAGES = {
    "ingest": {"code": "1" * 64, "settings": {"holdout": None}},
    "loop": {"code": "2" * 64, "settings": {"seed": 1}},
    "report": {"code": "c0de", "settings": {"style": "plain"}},
}


def results():
    sources = {f"r0{i}.csv": f"{i:064x}" for i in range(1, 10)}
    return Results(batch(), tables(), identified(), verdict(), told(), sources, STAGES, {"numpy": "2.1.0"})
