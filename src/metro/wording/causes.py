"""The causes of a batch, who bears witness of them, and what of an error came with the force."""

from __future__ import annotations

from collections.abc import Mapping

from metro.units import JSON, printed, printed_name
from metro.wording.candidates import Sentence
from metro.wording.names import plain

ENDS = {
    "together": "no observable shows it significantly by itself, but all together do; the models are not "
    "corrected for it",
    "contradiction": "the estimates differ by more than their uncertainties, so they are not one common "
    "cause",
    "confirmed": "and the estimates agree",
    "denied": "another observable would show it at that size, and does not",
    "alone": "the other observables are not sensitive enough to confirm it",
    "one_observable": "no other observable of this batch could show it",
}


def cause_in_words(cause: JSON) -> str:
    """Name a cause, what each observable says of it, and what follows from that."""
    named = _named(cause["cause"], cause["where"])
    if cause["status"] == "one_observable":
        return f"{named}: seen in {plain(cause['seen_in'][0])}; {ENDS['one_observable']}."
    witnesses = "; ".join(f"{plain(one['observable'])} {_says(one)}" for one in cause["witnesses"])
    text = f"{named}: {witnesses}; {ENDS[cause['status']]}"
    if cause["or_else"]:
        text += f" (alternative explanation: {' or '.join(cause['or_else'])})"
    if cause["status"] == "contradiction":
        p_value = cause["agreement"]["p_value"]
        text += f" (p = {p_value:.2g}): one of them has a further cause, or a wrong input"
    return text + "."


def split_in_words(split: JSON) -> str:
    """Say how much of an observable's error came with the force."""
    unit = printed(split["unit"])
    sentences = [
        f"{when.capitalize()}, the error with the predicted force is {parts['total']:.3g} {unit} rms "
        f"and with the measured force {parts['own']:.3g} {unit}. The predicted force contributes "
        f"{parts['upstream']:.3g} {unit}, with a standard uncertainty of {parts['doubt']:.2g} {unit} from "
        "the measured force."
        for when, parts in (("before", split["before"]), ("after", split["after"]))
    ]
    return " ".join(sentences)


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
    return plain(cause) + (f" of joint {where['joint']}" if "joint" in where else "")


def _cause(values: JSON) -> str:
    return _named(values["name"], {} if values["joint"] == "all" else {"joint": values["joint"]})


SENTENCES: Mapping[str, Sentence] = {
    "cause": _cause,
    "names_it": "identified it",
    "sees_it": "shows it",
    "denies_it": "does not show it, although it would",
    "cannot_tell": "is not sensitive enough",
}
