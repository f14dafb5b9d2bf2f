"""The story of a batch: its causes, each with where it was seen and how sure it is, in numbers and words."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from metro.loop.causes import SPEAKS, Judged, judged
from metro.loop.trial import Gates
from metro.loop.verdict import bounded, finite, parameters
from metro.loop.witnesses import Closed, Key, Witness, shared
from metro.units import JSON, printed, printed_name

BRIEF = ("cause", "where", "status", "probability", "parameters", "seen_in")
ENDS = {
    "together": "too weak to be named by any of them alone, and beyond chance in all together; the models "
    "are not corrected for it",
    "contradiction": "the estimates differ beyond their errors, so that it is not one cause of one size",
    "confirmed": "and the estimates agree",
    "alone": "the other observables that could show it cannot tell",
    "one_observable": "no other observable of this batch could show it",
}


def causes(closed: Mapping[str, Closed], verdicts: JSON, gates: Gates) -> list[JSON]:
    """Return the causes of a batch for loop.json, the surest first.

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
    told = {(entry["cause"], str(entry["where"].get("joint", "all"))) for entry in several}
    single: dict[tuple[str, str], JSON] = {}
    for name, verdict in verdicts.items():
        for effect in verdict.get("effects") or []:
            key = (effect["effect"], str(effect["parameters"].get("joint", "all")))
            if key in single:  # found upstream, and handed on with the coefficients
                single[key]["seen_in"].append(name)
            elif key not in told:
                single[key] = _single(name, effect)
    return sorted([*several, *single.values()], key=lambda entry: -entry["probability"])


def brief(entry: JSON) -> JSON:
    """Return what verdict.json says of a cause."""
    return {name: entry[name] for name in BRIEF}


def _single(observable: str, effect: JSON) -> JSON:
    """Tell a cause that one observable found and no other of the batch could show."""
    where = {name: value for name, value in effect["parameters"].items() if name == "joint"}
    entry = {
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
    words = f"{_named(effect['effect'], where)}: seen in {_plain(observable)}; {ENDS['one_observable']}."
    return entry | {"words": words}


def _entry(one: Judged) -> JSON:
    cause = one.cause
    first = cause.witnesses[0]
    where = {name: value for name, value in first.effect.where.items() if value != "all"}
    told = [_witness(witness) for witness in cause.witnesses]
    seen = [w["observable"] for w in told if w["found"] or one.status == "together" or w["says"] == "sees it"]
    agreement = {
        "chi2": cause.together.chi2,
        "freedom": cause.together.freedom,
        "p_value": cause.differ,
        "runs": cause.runs,
    }
    entry = {
        "cause": cause.key[0],
        "where": where,
        "status": one.status,
        "probability": one.probability,
        "parameters": _combined(one) if one.status != "contradiction" else {},
        "seen_in": seen,
        "statistic": cause.statistic,
        "p_value": cause.p_value,
        "witnesses": told,
        "agreement": agreement,
        "or_else": [_key_words(key) for key in one.or_else],
    }
    return entry | {"words": _words(one, entry)}


def _combined(one: Judged) -> JSON:
    """Return the parameters that all witnesses share, put together; within their bounds."""
    effect, together = one.cause.witnesses[0].effect, one.cause.together
    deviation = np.sqrt(np.diag(together.covariance))
    dof = float(max(1, one.cause.runs - 1))
    return {
        effect.parameters[i].name: bounded(effect.parameters[i], float(value), float(sd), dof)
        for i, value, sd in zip(shared(effect), together.value, deviation, strict=True)
    }


def _witness(witness: Witness) -> JSON:
    says = "found it" if witness.found else "cannot tell"
    if not witness.found and witness.evidence.p_value < SPEAKS:
        says = "sees it"
    gain = witness.evidence.gain if witness.evidence.held_out else math.nan
    return {
        "observable": witness.observable,
        "found": witness.found,
        "says": says,
        "statistic": witness.statistic,
        "p_value": witness.evidence.p_value,
        "held_out_gain": finite(gain),
        "size": witness.evidence.size,
        "systematic": witness.closed.problem.systematic,
        "parameters": parameters(witness.larger, witness.effect.name),
    }


def _words(one: Judged, entry: JSON) -> str:
    told = "; ".join(f"{_plain(w['observable'])} {_says(w)}" for w in entry["witnesses"])
    text = f"{_named(entry['cause'], entry['where'])}: {told}; {ENDS[one.status]}"
    if entry["or_else"]:
        text += f" (it may as well be {' or '.join(entry['or_else'])})"
    if one.status == "contradiction":
        text += f" (p = {one.cause.differ:.2g}): one of them has another cause besides, or a wrong input"
    return text + "."


def _says(witness: JSON) -> str:
    values = [
        _value(name, value)
        for name, value in witness["parameters"].items()
        if isinstance(value, dict) and value["value"] is not None and value["ci95"][0] is not None
    ]
    return f"{witness['says']} ({', '.join(values)})" if values else str(witness["says"])


def _value(name: str, entry: JSON) -> str:
    value, (low, high), unit = entry["value"], entry["ci95"], entry["unit"]
    return f"{printed_name(name, unit)} {value:.3g} ± {(high - low) / 2:.2g} {printed(unit)}".rstrip()


def _named(cause: str, where: JSON) -> str:
    return _plain(cause) + (f" of joint {where['joint']}" if "joint" in where else "")


def _key_words(key: Key) -> str:
    name, joint = key
    return _named(name, {} if joint == "all" else {"joint": joint})


def _plain(name: str) -> str:
    return name.replace("_", " ")
