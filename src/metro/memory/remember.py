"""What a campaign shows: the courses of parameters, effects that only all batches show, recurring effects."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from metro.memory.course import ENOUGH, Course, course
from metro.memory.history import CLAIMED, NORMAL, Record, Series, histories, natural
from metro.memory.regression import level
from metro.units import JSON, Array

LEAST = 3  # batches of a series
DISCOVERY = 0.05  # rate of false discoveries among the series, and among the pooled estimates
STEADY, TOO_FEW = "steady", "too few"


def remember(records: Sequence[Record]) -> JSON:
    """Return the content of ``memory.json``.

    ``series``: parameters of effects that were claimed at least once, and identified quantities. ``pooled``:
    effects that no batch claims, with their estimates combined. ``recurring``: how often an effect was
    claimed in a cell. ``undecided``: batches that cannot distinguish rivals, with what was claimed elsewhere.
    The printed tables of published works have no history and are not used.
    """
    records = [record for record in records if record.manifest.get("source") != "published"]
    long_enough = [one for one in histories(records) if len(one.entries) >= LEAST]
    claimed = {(one.owner, one.observable, one.effect) for one in long_enough if one.claimed_in}
    followed = [
        one for one in long_enough if not one.effect or (one.owner, one.observable, one.effect) in claimed
    ]
    pooled = [one for one in long_enough if one not in followed and one.signed]
    return {
        "format": 1,
        "batches": [record.name for record in sorted(records, key=lambda record: natural(record.name))],
        "series": _followed(followed),
        "pooled": _pooled(pooled),
        "recurring": _recurring(records),
        "undecided": _undecided(records),
    }


def _followed(series: Sequence[Series]) -> list[JSON]:
    courses = [course(one.t, one.column("value"), one.column("sd")) for one in series]
    q_values = _q_values([each.p_value for each in courses])
    return [_series(one, each, q) for one, each, q in zip(series, courses, q_values, strict=True)]


def _series(one: Series, followed: Course, q_value: float | None) -> JSON:
    changes = q_value is not None and q_value <= DISCOVERY
    kind = followed.kind if changes else STEADY if len(one.entries) >= ENOUGH else TOO_FEW
    mean, _ = level(one.column("value"), one.column("sd"))
    before = followed.before_step if kind == "step" else None
    return {
        **_names(one),
        "clock": one.clock,
        "batches": [entry.batch for entry in one.entries],
        "found": one.claimed_in,
        "t": one.t.tolist(),
        "value": one.column("value").tolist(),
        "sd": one.column("sd").tolist(),
        "course": kind,
        "p_value": followed.p_value,
        "q_value": q_value,
        "weights": followed.weights,
        "mean": _quantity([float(part[0]) for part in mean.interval()], one.unit),
        "change": _quantity(followed.change, one.unit) if changes and followed.change else None,
        "step_between": [one.entries[i].batch for i in (before, before + 1)] if before is not None else None,
        "track": _absolute(followed.track, 0.0 if one.effect else _typical(one.column("budget")) or 0.0),
        "next": {"t": followed.next_at, **_quantity(followed.after.tolist(), one.unit)},
        "scatter": followed.scatter,
    }


def _absolute(track: Array, alike: float) -> list[list[float]]:
    """Widen a course (n, 3), low, middle, high, by the relative error ``alike`` that all batches may share.

    A shared error does not average out over the batches; the changes between them are known better.
    """
    low, middle, high = track.T
    wrong = NORMAL * alike * np.abs(middle)
    ends = middle - np.hypot(middle - low, wrong), middle, middle + np.hypot(high - middle, wrong)
    columns: list[list[float]] = np.stack(ends, axis=1).tolist()
    return columns


def _pooled(series: Sequence[Series]) -> list[JSON]:
    rows = [_together(one) for one in series]
    for row, q in zip(rows, _q_values([row["p_value"] for row in rows]), strict=True):
        small = row["size"] is not None and row["budget"] is not None and row["size"] < row["budget"]
        row["q_value"] = q
        row["shown"] = q is not None and q <= DISCOVERY and not small
        row["below_budget"] = q is not None and q <= DISCOVERY and small
    return sorted(rows, key=lambda row: row["p_value"])


def _together(one: Series) -> JSON:
    """Combine the estimates of an effect that no batch claims alone."""
    value, sd = one.column("value"), one.column("sd")
    neutral = value - one.column("less_neutral")
    mean, p_value = level(value - neutral, sd)
    low, middle, high = (float(part[0]) for part in mean.interval())
    sensitivity = _typical(one.column("sensitivity"))
    zero = float(neutral[0])
    return {
        **_names(one),
        "batches": [entry.batch for entry in one.entries],
        "estimate": _quantity((low + zero, middle + zero, high + zero), one.unit),
        "neutral": zero,
        "same_sign": int(np.sum(np.sign(value - neutral) == np.sign(middle))),
        "best_alone": float(np.max(np.abs(value - neutral) / sd)),
        "p_value": p_value,
        "size": None if sensitivity is None else sensitivity * abs(middle) / float(np.median(sd)),
        "budget": _typical(one.column("budget")),
    }


def _typical(values: Array) -> float | None:
    """Median of the numbers that are known."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else None


def _recurring(records: Sequence[Record]) -> list[JSON]:
    """Count how often each effect was claimed by the batches of a cell that could have claimed it."""
    from scipy.stats import beta

    rows = []
    for (cell, observable, effect), (tried, claiming) in sorted(_counted(records).items()):
        if len(tried) < 2 or not claiming:
            continue
        k, n = len(claiming), len(tried)
        share = beta.ppf([0.025, 0.5, 0.975], k + 0.5, n - k + 0.5)
        rows.append(
            {
                "cell": cell,
                "observable": observable,
                "effect": effect,
                "found": claiming,
                "tried": tried,
                "share": _quantity([float(part) for part in share], "1"),
            }
        )
    return rows


def _counted(records: Sequence[Record]) -> dict[tuple[str, str, str], tuple[list[str], list[str]]]:
    """Batches that could have claimed an effect, and batches that did claim it."""
    counted: dict[tuple[str, str, str], tuple[list[str], list[str]]] = {}
    for record in sorted(records, key=lambda record: natural(record.name)):
        for observable, verdict in (record.verdict.get("observables") or {}).items():
            status = str(verdict.get("status"))
            claimed = [str(effect["effect"]) for effect in verdict.get("effects") or []]
            rejected = [str(each["effect"]) for each in verdict.get("candidates") or []]
            if status not in {"clean", *CLAIMED}:
                continue
            for effect in dict.fromkeys([*claimed, *rejected]):
                tried, claiming = counted.setdefault((record.cell, observable, effect), ([], []))
                tried.append(record.name)
                if effect in claimed:
                    claiming.append(record.name)
    return counted


def _undecided(records: Sequence[Record]) -> list[JSON]:
    """Count the claims of other batches of a cell for rivals that a batch cannot distinguish.

    The verdict of the batch does not change.
    """
    counted = _counted(records)
    rows = []
    for record in sorted(records, key=lambda record: natural(record.name)):
        for observable, verdict in (record.verdict.get("observables") or {}).items():
            for pair in verdict.get("indistinguishable") or []:
                known = {name: counted.get((record.cell, observable, name), ([], [])) for name in pair}
                if any(claiming for _, claiming in known.values()):
                    elsewhere = {
                        name: [len(claiming), len(tried)] for name, (tried, claiming) in known.items()
                    }
                    rows.append({"batch": record.name, "observable": observable, "elsewhere": elsewhere})
    return rows


def _names(one: Series) -> JSON:
    names = {"owner": one.owner, "observable": one.observable, "effect": one.effect}
    return {**names, "quantity": one.quantity, "unit": one.unit}


def _quantity(ends: Sequence[float], unit: str) -> JSON:
    low, middle, high = ends
    return {"value": middle, "ci95": [low, high], "unit": unit}


def _q_values(p_values: Sequence[float | None]) -> list[float | None]:
    """Least rate of false discoveries (Benjamini–Hochberg) at which each is a discovery; None stays None."""
    from scipy.stats import false_discovery_control

    known = [p for p in p_values if p is not None]
    discoveries = iter(false_discovery_control(known).tolist() if known else [])
    return [None if p is None else float(next(discoveries)) for p in p_values]
