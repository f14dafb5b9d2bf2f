"""Campaigns drawn at the level of verdicts: what batches would say of a machine whose truth is known."""

import numpy as np

from metro.memory.history import Record

BATCHES = 20
BUDGET = 0.007
STEP_AFTER = 11


def truth(place):
    """Parameters at places 0, 1, … of the order: a tool wears, a spindle warms up, a joint is mended."""
    place = np.asarray(place, dtype=float)
    return {
        "kte": 14.0 * (1.0 + 0.015 * place),
        "growth": 0.5 + 6.0 * np.exp(-place / 5.0),
        "joint 2": np.where(place <= STEP_AFTER, 1.0e6, 0.8e6),
        "ktc": np.full_like(place, 850.0),
        "tilt": np.full_like(place, 0.02),
        "bow": np.zeros_like(place),
    }


SD = {"kte": 0.4, "growth": 0.35, "joint 2": 2.5e4, "ktc": 12.0, "tilt": 0.025, "bow": 1.0}
BETWEEN = {"kte": 0.3, "growth": 0.25, "joint 2": 2.0e4, "ktc": 15.0, "tilt": 0.015, "bow": 0.8}


def drawn(rng, batches=BATCHES, started=True):
    """Return records of a campaign, and the truth of every batch (scatter between batches included)."""
    course, own, records = truth(np.arange(batches)), {}, []
    for name, values in course.items():
        own[name] = values + rng.normal(0.0, BETWEEN[name], batches)
    for i in range(batches):
        sd = {name: SD[name] * np.exp(rng.uniform(-0.4, 0.4)) for name in SD}
        value = {name: rng.normal(own[name][i], sd[name]) for name in SD}
        found = value["growth"] > 5.0 * sd["growth"]
        records.append(_record(i, value, sd, found, started))
    return records, own


def quantity(value, sd, unit):
    return {"value": value, "ci95": [value - 1.96 * sd, value + 1.96 * sd], "unit": unit}


def estimate(parameter, value, sd, unit):
    flags = {"signed": True, "inside": True, "angle": False, "index": 0, "less_neutral": value}
    return {"parameter": parameter, "value": value, "sd": sd, "unit": unit, **flags}


def tried(effect, verdict, *estimates, size=0.01):
    base = {"effect": effect, "verdict": verdict, "size": size, "chosen_among": 1, "where": {}}
    return {**base, "estimates": list(estimates)}


def record(name, status, candidates, claimed=(), *, identified=None, started=None, cell="cell-a", **verdict):
    """Return a record of a batch with a verdict on flatness."""
    entry = {"status": status, "effects": [{"effect": e, "parameters": {}} for e in claimed], **verdict}
    entry["candidates"] = [{"effect": c["effect"]} for c in candidates if c["effect"] not in claimed]
    told = {"candidates": candidates, "noise": {"budget": BUDGET}}
    manifest = {"cell": cell, "source": "measured", "tool": {"diameter_mm": 12, "teeth": 3}}
    return Record(
        name,
        {**manifest, "work": {"material": "AA6061"}},
        started,
        {"observables": {"flatness": entry}},
        {"observables": {"flatness": told}},
        identified or {},
    )


def _record(i, value, sd, found, started):
    candidates = [
        tried(
            "thermal_growth",
            "added" if found else "rejected",
            estimate("rate_um_per_min", value["growth"], sd["growth"], "um/min"),
        ),
        tried("spindle_tilt", "rejected", estimate("about_x_mrad", value["tilt"], sd["tilt"], "mrad")),
        tried("fixture_bow", "rejected", estimate("xx_um", value["bow"], sd["bow"], "um")),
    ]
    stiff = [quantity(value["joint 2"], sd["joint 2"], "N*m/rad")]
    waveform = {name: quantity(value[name], sd[name], "N/mm") for name in ("kte", "ktc")}
    identified = {"force": {"waveform": waveform}, "arm": {"joint_stiffness": stiff}}
    return record(
        f"b-{i + 1}",
        "explained" if found else "clean",
        candidates,
        ["thermal_growth"] if found else [],
        identified=identified,
        started=1.7e9 + 7200.0 * i if started else None,
    )
