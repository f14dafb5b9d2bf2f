"""The story of a batch: its causes, each with where it was seen and how sure it is, in numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from metro.loop.causes.causes import SPEAKS, Judged, judged
from metro.loop.causes.witnesses import Closed, Witness, denial, shared
from metro.loop.search.trial import Gates
from metro.loop.statement import Statement
from metro.loop.verdict.verdict import bounded, finite, parameters
from metro.units import JSON


def causes(closed: Mapping[str, Closed], verdicts: JSON, gates: Gates) -> list[JSON]:
    """Return the causes of a batch, the surest first.

    Parameters
    ----------
    closed : the observables that had something to fit. verdicts : the entries of verdict.json.
    """
    usable = {
        name: one
        for name, one in closed.items()
        if verdicts.get(name, {}).get("status", "insufficient") != "insufficient"
    }
    several = [_entry(one) for one in judged(usable, gates)]
    judged_together = {(entry["cause"], str(entry["where"].get("joint", "all"))) for entry in several}
    single: dict[tuple[str, str], JSON] = {}
    for name, verdict in verdicts.items():
        for effect in verdict.get("effects") or []:
            key = (effect["effect"], str(effect["parameters"].get("joint", "all")))
            if key in single:  # named upstream, and handed on with the coefficients; or in another series
                single[key]["seen_in"] += [name] if name not in single[key]["seen_in"] else []
            elif key not in judged_together:
                single[key] = _single(name, effect)
    return sorted([*several, *single.values()], key=lambda entry: -entry["probability"])


def _single(observable: str, effect: JSON) -> JSON:
    """Return a cause that one observable named and no other of the batch could show."""
    where = {name: value for name, value in effect["parameters"].items() if name == "joint"}
    return {
        "cause": effect["effect"],
        "where": where,
        "status": "one_observable",
        "probability": effect["probability"],
        "parameters": {name: value for name, value in effect["parameters"].items() if name not in where},
        "seen_in": [observable],
        "witnesses": [],
        "agreement": None,
        "or_else": [],
    }


def _entry(one: Judged) -> JSON:
    cause = one.cause
    first = cause.witnesses[0]
    where = {name: value for name, value in first.effect.where.items() if value != "all"}
    seen = [w.observable for w in cause.witnesses if one.status == "together" or _bears_witness(w)]
    agreement = {
        "chi2": cause.together.chi2,
        "freedom": cause.together.freedom,
        "p_value": cause.differ,
        "runs": cause.runs,
    }
    return {
        "cause": cause.key[0],
        "where": where,
        "status": one.status,
        "probability": one.probability,
        "parameters": _combined(one) if one.status != "contradiction" else {},
        "seen_in": seen,
        "statistic": cause.statistic,
        "p_value": cause.p_value,
        "witnesses": [_witness(witness, first) for witness in cause.witnesses],
        "agreement": agreement,
        "or_else": [Statement("cause", {"name": name, "joint": joint}) for name, joint in one.or_else],
    }


def _combined(one: Judged) -> JSON:
    """Return the parameters that all witnesses share, put together; within their bounds."""
    effect, together = one.cause.witnesses[0].effect, one.cause.together
    deviation = np.sqrt(np.diag(together.covariance))
    dof = float(max(1, one.cause.runs - 1))
    return {
        effect.parameters[i].name: bounded(effect.parameters[i], float(value), float(sd), dof)
        for i, value, sd in zip(shared(effect), together.value, deviation, strict=True)
    }


def _bears_witness(witness: Witness) -> bool:
    """Whether an observable named a cause, or sees one that it did not name."""
    return witness.names_it or witness.evidence.p_value < SPEAKS


def _says(witness: Witness, first: Witness) -> Statement:
    if witness.names_it:
        return Statement("names_it")
    if _bears_witness(witness):
        return Statement("sees_it")
    return Statement("denies_it" if denial(witness, first) < SPEAKS else "cannot_tell")


def _witness(witness: Witness, first: Witness) -> JSON:
    gain = witness.evidence.gain if witness.evidence.held_out else math.nan
    return {
        "observable": witness.observable,
        "found": witness.names_it,
        "says": _says(witness, first),
        "statistic": witness.statistic,
        "p_value": witness.evidence.p_value,
        "held_out_gain": finite(gain),
        "size": witness.evidence.size,
        "systematic": witness.closed.problem.systematic,
        "parameters": parameters(witness.larger, witness.effect.name),
    }
