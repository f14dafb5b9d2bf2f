"""A row of the log: what a program's answers about a suite are worth, in numbers alone."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from metro.units import JSON
from proof.figures import demanded, further, kind, over_floor, undecided
from proof.score import FAILED, Score, Stated
from proof.statistics import Figure, binned, brier, calibration_error, share, uniform
from proof.tables import KINDS

FORMAT = 1


def row(program: str, scores: Sequence[Score], head: JSON) -> JSON:
    """Return the row of a program.

    Parameters
    ----------
    program : its name. scores : of its answers, by batch. head : what is known of the suite.
    """
    figures = [*demanded(scores), *further(scores)]
    figures += undecided(scores) if head["observable"] == "lobes" else []
    inside = [s for s in scores if s.kind in {"one", "two"} and s.seen]
    named = [pair for s in scores for pair in s.stated]
    return {
        "format": FORMAT,
        "program": program,
        **head,
        "counts": {name: _counts([*kind(scores, name)]) for name in KINDS},
        "failures": {s.batch: s.failure for s in scores if s.status == FAILED},
        "outside_kinds": len({s.hidden for s in kind(scores, "outside")}),
        "figures": [_figure(figure) for figure in figures],
        "named": _calibration(named),
        "tried": _calibration([*named, *(pair for s in scores for pair in s.rejected)]),
        "parameters": _parameters(inside),
        "over_floor": _spread(over_floor(inside)),
        "nothing_hidden": _null([s.p_value for s in kind(scores, "none") if s.p_value is not None]),
    }


def _counts(scores: Sequence[Score]) -> JSON:
    return {"batches": len(scores), "seen": sum(s.seen for s in scores)}


def _figure(figure: Figure) -> JSON:
    entry: JSON = {
        "label": figure.label,
        "value": _finite(figure.value),
        "ci95": [_finite(figure.low), _finite(figure.high)],
        "count": figure.count,
        "unit": figure.unit,
    }
    if figure.demand is None:
        return entry
    return entry | {"demand": [figure.demand.least, figure.demand.most], "met": figure.met}


def _calibration(stated: Sequence[Stated]) -> JSON:
    """Return the reliability curve of stated probabilities, bin by bin, and what it comes to."""
    bins = [
        {
            "from": one.low,
            "to": one.high,
            "count": one.count,
            "stated": one.stated,
            "came_true": one.came_true.value,
            "ci95": [one.came_true.low, one.came_true.high],
        }
        for one in binned(stated)
    ]
    return {
        "count": len(stated),
        "bins": bins,
        "calibration_error": _finite(calibration_error(stated)),
        "brier": _finite(brier(stated)),
    }


def _parameters(scores: Sequence[Score]) -> list[JSON]:
    """Return by parameter how often its interval holds the truth."""
    estimates = [one for s in scores for one in s.estimates]
    entries = []
    for key in sorted({(one.effect, one.parameter) for one in estimates}):
        group = [one for one in estimates if (one.effect, one.parameter) == key]
        covered = share("", [one.covered for one in group if one.covered is not None])
        entries.append(
            {
                "effect": key[0],
                "parameter": key[1],
                "count": covered.count,
                "covered": _finite(covered.value),
                "ci95": [covered.low, covered.high],
                "median_error": float(np.median([abs(one.error) for one in group])),
            }
        )
    return entries


def _spread(ratios: Sequence[float]) -> JSON:
    """Return median, quartiles and the ninth decile of held-out error over noise."""
    if not ratios:
        return {"count": 0}
    low, middle, high, ninth = np.quantile(ratios, [0.25, 0.5, 0.75, 0.9]).tolist()
    return {"count": len(ratios), "median": middle, "quartiles": [low, high], "ninth_decile": ninth}


def _null(p_values: Sequence[float]) -> JSON:
    """Return the p-values that were stated where nothing is hidden, and whether they are uniform."""
    if not p_values:
        return {"count": 0}
    distance, p_value = uniform(p_values)
    return {
        "count": len(p_values),
        "p_values": [round(p, 4) for p in sorted(p_values)],
        "distance": distance,
        "p_value": p_value,
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
