"""The verdict on an arm by measured poses: what was found, how sure it is, the residual and its kind.

It is written from what ``identify`` found (block ``pose`` of identified.json) and the errors on poses that
were left out; nothing is fitted here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd

from metro.loop.fitting.held_out import COMPARISON
from metro.loop.statement import Statement
from metro.loop.verdict.verdict import error
from metro.units import JSON, Array

NAME, UNIT = "pose", "mm"
DECIDES = "region"  # errors on poses of quarters of the workspace that no fit saw are before and after
STAGES = ("nominal", "geometry", "effects")
GEOMETRY = "kinematic_error"
# Kind of effect of a calibration → its name in the contract.
EFFECTS = {
    "eccentricity": "gear_eccentricity",
    "elasticity": "gravity_elasticity",
    "approach": "joint_backlash",  # where the joint lags; where it leads, see :func:`_name`
    "torque_side": "gravity_play",
    "base_tilt": "base_tilt",
    "drift": "pose_drift",
    "warmth": "thermal_expansion",
    "curve": "reading_curve",
}
TORN = 0.5  # probability that an effect has at most where another does as well in its place
WORST = ("unexplained", "undetermined", "partly_explained", "explained", "clean")
CHANCE = 0.05  # of a rest as far beyond the known noise where it is no more than that
# Relative standard deviation of the median of chi-squared of so many degrees of freedom, times the root of m.
MEDIAN_SD = {1: 2.333, 3: 1.124}
MILLIDEGREES = 180.0 / math.pi  # of 1 mrad


def judged(block: JSON, errors: pd.DataFrame, seed: int) -> tuple[JSON, JSON, pd.DataFrame] | None:
    """Return the entries of verdict.json and loop.json and the rows of the comparison; None without a series.

    Parameters
    ----------
    block : ``pose`` of identified.json. errors : table ``pose_errors``. seed : of the bootstrap.
    """
    series = {run: one for run, one in block.items() if run != "not_identified"}
    if not series:
        return None
    held = errors[errors["kind"] == DECIDES].reset_index(drop=True)
    rows = _rows(held)
    regions = held["run"].astype(str) + "/" + held["region"].astype(str)
    by_cluster = rows.assign(run=regions.loc[rows.index].to_numpy())
    rows = rows.reset_index(drop=True)
    left = {run: _significant(one) for run, one in series.items()}
    effects = [
        effect for run, one in series.items() for effect in _effects(one, run if series_of(block) else "")
    ]
    floors = [one["noise"]["value"] for one in series.values() if one.get("noise")]
    floor = float(np.sqrt(np.mean(np.square(floors)))) if len(floors) == len(series) else None
    before, after = (error(by_cluster, stage, seed) for stage in ("before", "after"))
    statuses = [_status(one, left[run]) for run, one in series.items()]
    verdict = {
        "status": min(statuses, key=WORST.index),
        "unit": UNIT,
        "noise_floor": floor,
        "held_out_runs": [],
        "held_out": {
            "poses": len(held[["run", "pose"]].drop_duplicates()),
            "by": DECIDES,
            "of": "coordinate" if "nominal_x_mm" in held else "distance",
        },
        "before": before,
        "after": after,
        "verification": None,
        "effects": effects,
        "candidates": [entry for run, one in series.items() for entry in _candidates(one)],
        "indistinguishable": [list(pair) for one in series.values() for pair in _rivals(one)],
        "next_experiment": _next(series, left),
        "unexplained": _unexplained(series, left, after) if any(left.values()) else None,
        "words": Statement(
            "pose_verdict", {"series": {run: _told(one, left[run]) for run, one in series.items()}}
        ),
    }
    return verdict, _story(rows, held, effects), rows


def series_of(block: JSON) -> bool:
    """Return whether a block has several series, so that their runs have to be named."""
    return sum(run != "not_identified" for run in block) > 1


def probability(p_value: float) -> float:
    """Return what a p-value leaves of a probability at most, of a cause as likely as not before.

    The odds for chance are at least −e p ln p (Sellke, Bayarri & Berger, Am. Stat. 55 (2001) 62).
    """
    p = min(max(p_value, 1e-300), 1.0 / math.e)
    return 1.0 / (1.0 - math.e * p * math.log(p))


def _rows(held: pd.DataFrame) -> pd.DataFrame:
    """Return rows of the comparison: each coordinate of each pose, x of all, then y, then z.

    Of a measured distance that alone. The index is that of ``held``.
    """
    by_place = held if "distance_mm" not in held else held[held["distance_mm"].isna()]
    by_line = held.drop(by_place.index)
    parts = [_coordinate(by_place, axis) for axis in "xyz"] if len(by_place) else []
    return pd.concat([*parts, *([_coordinate(by_line, "distance")] if len(by_line) else [])])


def _coordinate(held: pd.DataFrame, axis: str) -> pd.DataFrame:
    at = held[f"{axis}_mm"]
    rows: dict[str, object] = dict.fromkeys(COMPARISON)
    rows |= {"observable": NAME, "run": held["run"].astype(str), "axis": axis, "unit": UNIT}
    rows |= {"measured": at, "sigma": held["sigma_mm"]}
    rows |= {"before": at - held[f"nominal_{axis}_mm"], "after": at - held[f"effects_{axis}_mm"]}
    return pd.DataFrame(rows, columns=list(COMPARISON), index=held.index)


def _errors(held: pd.DataFrame, stage: str) -> Array:
    """Return the errors (k,) mm of a stage, in all coordinates of positions and of all distances."""
    columns = [name for axis in ("x", "y", "z", "distance") if (name := f"{stage}_{axis}_mm") in held]
    errors = held[columns].to_numpy(dtype=float)
    return np.asarray(errors[np.isfinite(errors)])


def _significant(one: JSON) -> bool:
    """Whether a rest is more than noise: others predict a part of it, or it is beyond the known noise."""
    from scipy.stats import norm

    if one["ceiling"]["ci95"][0] > 0.0:
        return True
    if not one.get("noise"):
        return False
    beyond = (one["scatter"]["value"] / one["noise"]["value"]) ** 2
    if one["noise"]["source"] == "repeats":  # the scatter then has them in it
        beyond -= 1.0
    spread = MEDIAN_SD[_dimensions(one)] ** 2 / _count(one) + 2.0 / one["noise"].get("freedom", math.inf)
    return bool(beyond > norm.isf(CHANCE) * math.sqrt(spread))


def _dimensions(one: JSON) -> int:
    """Return how many coordinates of a pose were measured: its position, or its distance alone."""
    return 1 if one.get("measured") == "distances" else 3


def _count(one: JSON) -> int:
    """Return how many positions or distances a series has: from several stations, several of a pose."""
    return int(one["rows"] if "rows" in one else one["poses"])


def _status(one: JSON, rest: bool) -> str:
    """Return the status of a series; with rivals it is undetermined where nothing else was found."""
    found = _effects(one, "")
    if found and all(effect["probability"] <= TORN for effect in found):
        return "undetermined"
    if found:
        return "partly_explained" if rest else "explained"
    return "unexplained" if rest else "clean"


def _effects(one: JSON, run: str) -> list[JSON]:
    """Return the effects of a series: corrected rows by joint, then the others; ``run`` where named."""
    where = {"run": run} if run else {}
    return [
        *({**effect, **where} for effect in _of_geometry(one)),
        *({**_effect(effect, one), **where} for effect in one["effects"]),
    ]


def _of_geometry(one: JSON) -> list[JSON]:
    """Return the joints whose rows differ from the declared ones by more than chance, all joints counted."""
    tests = one["geometry"]
    found = []
    for test in tests:
        p_value = min(1.0, len(tests) * test["p_value"])
        if p_value >= CHANCE:
            continue
        own = {}
        for label, value in one["corrections"].items():
            _, number, kind = label.split(" ", 2)
            if int(number) == test["joint"]:
                own[f"{kind.replace(' ', '_')}_{value['unit']}"] = value
        entry = {"effect": GEOMETRY, "probability": probability(p_value), "p_value": p_value}
        found.append(entry | {"parameters": {"joint": test["joint"], **own}})
    return found


def _effect(effect: JSON, one: JSON) -> JSON:
    torn = any(effect["title"] == first for first, _ in one["rivals"])
    chance = probability(effect["p_value"])
    return {
        "effect": _name(effect),
        "probability": min(chance, TORN) if torn else chance,
        "p_value": effect["p_value"],
        "held_out_gain": log_likelihood(effect["gain"], one),
        "parameters": {
            **({"joint": effect["joint"]} if "joint" in effect else {}),
            **dict(_parameter(effect["effect"], name, value) for name, value in effect["parameters"].items()),
            "moves_mm": effect["moves"],
        },
    }


def _name(effect: JSON) -> str:
    """Return the contract's name; a joint that is ahead of its reading has no backlash, but a hysteresis."""
    ahead = effect["effect"] == "approach" and effect["parameters"]["half play"]["value"] > 0.0
    return "joint_hysteresis" if ahead else EFFECTS[effect["effect"]]


def _parameter(code: str, name: str, value: JSON) -> tuple[str, JSON]:
    """Name a parameter with its unit.

    What the direction of approach does is found as half of it, positive where the joint is ahead; a gap is
    whole, and positive where it lags.
    """
    if code != "approach":
        return f"{name.replace(' ', '_')}_{value['unit'].replace('/', '_')}", value
    angle = value["unit"] == "mrad"
    scale, unit, key = (-2 * MILLIDEGREES, "mdeg", "angle_mdeg") if angle else (-2e3, "um", "gap_um")
    ends = sorted(scale * end for end in value["ci95"])
    return key, {"value": scale * value["value"], "ci95": ends, "unit": unit}


def log_likelihood(gain: float, one: JSON) -> float:
    """Return a mean gain of left-out regions (docs/poses.md) as a log-likelihood of all poses of a series."""
    return float(0.5 * _dimensions(one) * gain * _count(one))


def _candidates(one: JSON) -> list[JSON]:
    return [
        {
            "effect": EFFECTS[trial["code"]],
            **({"joint": trial["joint"]} if "joint" in trial else {}),
            "probability": None,
            "held_out_rms": None,
            "held_out_gain": log_likelihood(trial["gain"], one),
            "p_value": trial["p_value"],
            "why_not": Statement("pose_no_gain", {"gain": trial["gain"], "p_value": trial["p_value"]}),
        }
        for trial in one["tried"]
        if not trial["kept"]
    ]


def _rivals(one: JSON) -> list[tuple[str, str]]:
    """Return pairs of effects that these poses do not distinguish, by their contract's names."""
    names = {trial["effect"]: _named(trial) for trial in one["tried"]}
    return [(names[first], names[second]) for first, second in one["rivals"]]


def _named(trial: JSON) -> str:
    return EFFECTS[trial["code"]] + (f" (joint {trial['joint']})" if "joint" in trial else "")


def _next(series: Mapping[str, JSON], left: Mapping[str, bool]) -> Statement:
    rivals = [list(pair) for one in series.values() for pair in _rivals(one)]
    rest = {run: _kind(one) for run, one in series.items() if left[run]}
    noise = [run for run, one in series.items() if not one.get("noise")]
    return Statement("pose_next", {"rivals": rivals, "rest": rest, "without_noise": noise})


def _kind(one: JSON) -> str:
    """Return of which kind the largest part of a rest is that others predict; "alone" where none do."""
    if one["ceiling"]["ci95"][0] <= 0.0:
        return "alone"
    return str(next(iter(one["ceiling"]["parts"])))


def _unexplained(series: Mapping[str, JSON], left: Mapping[str, bool], after: JSON) -> JSON:
    named = {run: one for run, one in series.items() if left[run]}
    ceilings = {run: one["ceiling"] for run, one in named.items()}
    return {
        "rms": after["rms"],
        "unit": UNIT,
        "signature": Statement(
            "pose_left",
            {"series": {run: _rest(one) for run, one in named.items()}, "several": len(series) > 1},
        ),
        "ceiling": {
            "series": ceilings,
            "words": Statement("pose_ceiling", {"series": ceilings, "several": len(series) > 1}),
        },
    }


def _rest(one: JSON) -> JSON:
    measured = one.get("measured", "positions")
    return {"scatter": one["scatter"]["value"], "noise": one.get("noise"), "measured": measured}


def _told(one: JSON, rest: bool) -> JSON:
    """Return what a sentence on a series holds."""
    return {
        "poses": one["poses"],
        "medians": {
            kind: {stage: errors[stage]["median"]["value"] for stage in STAGES}
            for kind, errors in one["errors"].items()
        },
        "effects": [
            {
                "effect": effect["effect"],
                "joint": effect["parameters"].get("joint"),
                "probability": effect["probability"],
            }
            for effect in _effects(one, "")
        ],
        "rivals": [list(pair) for pair in _rivals(one)],
        "rest": _rest(one) if rest else None,
    }


def _story(rows: pd.DataFrame, held: pd.DataFrame, effects: list[JSON]) -> JSON:
    """Return the entry of loop.json: how the model grew, with the errors on poses left out."""
    signal = float(np.sqrt(np.mean(rows["measured"].to_numpy(dtype=float) ** 2)))
    added = dict.fromkeys(effect["effect"] for effect in effects)
    steps = {
        "nominal": [],
        "geometry": [GEOMETRY],
        "effects": list(added) if GEOMETRY in added else [GEOMETRY, *added],
    }
    path = []
    for stage, names in steps.items():
        rms = float(np.sqrt(np.mean(_errors(held, stage) ** 2)))
        path.append({"added": names, "held_out_rms": rms, "nrmse": rms / signal})
    return {"unit": UNIT, "path": path}
