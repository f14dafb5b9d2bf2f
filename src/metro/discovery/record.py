"""What a search found, as numbers and statements: for the terminal, for programs, and for the draft."""

from __future__ import annotations

import math

from metro.discovery.search import Search, Tried
from metro.loop.fitting.fit import Fit
from metro.loop.fitting.held_out import comparison, held_out
from metro.loop.planning.experiment import prospects
from metro.loop.verdict.verdict import parameters
from metro.observables.problem import Problem
from metro.units import JSON

AS_GOOD = 0.05  # weight above which another term explains the runs as well


def record(search: Search, problem: Problem) -> JSON:
    """Return what was tried and what is proposed; the held-out runs are read for the proposal alone."""
    chosen = search.proposal
    entry: JSON = {
        "admitted": search.count,
        "ceiling": _ceiling(search),
        "explainable": search.explainable,
        "terms": [_term(one) for one in search.terms],
        "proposal": None,
    }
    if chosen:
        entry["proposal"] = {
            "name": chosen.entry.name,
            "as_good": [one.entry.name for one in _as_good(search, chosen)],
            "verification": verified(search.current, chosen.trial.fit, problem),
            "test": _test(search, chosen, problem),
        }
    return entry


def _ceiling(search: Search) -> JSON | None:
    if search.ceiling is None:
        return None
    kept = ("share", "ci95", "noise_share", "parts")
    return {name: search.ceiling[name] for name in kept}


def _term(one: Tried) -> JSON:
    trial, evidence = one.trial, one.trial.evidence
    return {
        "name": one.entry.name,
        "formula": one.entry.formula,
        "words": one.entry.words,
        "acts_in": one.entry.quantity,
        "variables": list(one.entry.variables),
        "form": one.entry.form,
        "parameters": parameters(trial.fit, one.entry.name),
        "q_value": trial.q_value,
        "size": evidence.size,
        "gain": evidence.gain if evidence.held_out and math.isfinite(evidence.gain) else None,
        "better_share": evidence.better_share if evidence.held_out else None,
        "share": one.share,
        "weight": trial.weight,
        "why_not": trial.why_not,
    }


def _as_good(search: Search, chosen: Tried) -> list[Tried]:
    """Return the other terms that passed and explain the runs about as well."""
    return [one for one in search.terms if one is not chosen and one.passed and one.trial.weight > AS_GOOD]


def verified(current: Fit, larger: Fit, problem: Problem) -> JSON | None:
    """Return the rms error on the held-out runs of a fit and of a larger one, as a whole and by run."""
    if not problem.role("validate"):
        return None
    rows = comparison(problem, held_out(problem, current), held_out(problem, larger))
    squares = rows.assign(
        before=(rows["measured"] - rows["before"]) ** 2, after=(rows["measured"] - rows["after"]) ** 2
    )
    whole = squares[["before", "after"]].mean() ** 0.5
    each = squares.groupby("run")[["before", "after"]].mean() ** 0.5
    return {
        "unit": problem.unit,
        "before": float(whole["before"]),
        "after": float(whole["after"]),
        "noise": float((rows["sigma"] ** 2).mean() ** 0.5),
        "runs": {str(run): [float(row["before"]), float(row["after"])] for run, row in each.iterrows()},
    }


def _test(search: Search, chosen: Tried, problem: Problem) -> JSON | None:
    """Return the runs that would best show whether the term is there, and how surely they decide it."""
    if not problem.feasible:
        return None
    best = prospects(search.current, chosen.trial.fit, problem.feasible)[0]
    return {"words": best.proposal.words, "repeats": best.repeats, "probability": best.probability}
