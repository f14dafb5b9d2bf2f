"""What to measure next: which runs decide, describe, show or tighten what a batch leaves open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from metro.units import JSON
from metro.wording.candidates import Sentence
from metro.wording.names import chance, cut, listed, pair, plain

# Joins an experiment to the residual that it is to characterise, which the report states beside it.
TO_CHARACTERISE = ", to characterise the remaining error: "


def _decide(values: JSON) -> str:
    return "; ".join(values["parts"])


def _decides(values: JSON) -> str:
    runs = " and ".join(map(cut, values["runs"]))
    return f"{runs}: this distinguishes {_pairs(values['pairs'])}"


def _pairs(pairs: Sequence[JSON]) -> str:
    """Name pairs, each with the probability that it is decided."""
    return " and ".join(
        f"{pair(one['pair'])} with a probability of {chance(one['probability'])}" for one in pairs
    )


def _nearly_decides(values: JSON) -> str:
    return (
        f"{cut(values['run'])}: the best of the runs considered to distinguish {pair(values['pair'])}, "
        f"but it decides only with a probability of {chance(values['probability'])}"
    )


def _own_experiments(values: JSON) -> str:
    names = " or ".join(map(pair, values["pairs"]))
    tried = f"no run of the kinds considered distinguishes {names}; " if values["tried"] else ""
    return tried + "; or ".join(f"for {plain(name)}: {text}" for name, text in values["experiments"].items())


def _none_decides(values: JSON) -> str:
    return f"no permitted run distinguishes the rival causes; {values['otherwise']}"


def _describe(values: JSON) -> str:
    return (
        f"repeat condition {values['condition']} several times, spread over the session"
        f"{TO_CHARACTERISE}{values['residual']}"
    )


def _describe_again(values: JSON) -> str:
    return f"repeat condition {values['condition']}{TO_CHARACTERISE}{values['residual']}"


def _show(values: JSON) -> str:
    hidden = values["hidden"]
    parts = [f"to check for {listed(one['effects'])}, use {one['proposal']}" for one in values["shown"]]
    if hidden:
        parts.append(f"to check for {plain(hidden[0])}, use {values['experiment']}")
    if len(hidden) > 1:
        parts.append(f"no run of the kinds considered shows {listed(hidden[1:])}")
    return "; ".join(parts)


def _would_show(values: JSON) -> str:
    return (
        f"{cut(values['run'])}: this would show {listed(values['effects'])}, which these runs cannot show. "
        f"An effect of the usual size is detected with a probability of {chance(values['probability'])}"
    )


def _none_shows(values: JSON) -> str:
    experiments = values["experiments"]
    texts = "; ".join(f"for {plain(name)}: {text}" for name, text in experiments.items())
    return f"no run of the kinds considered shows {listed(list(experiments))}; {texts}"


def _tightens(values: JSON) -> str:
    return (
        f"{cut(values['run'])}: the uncertainty of the parameters, mainly of {values['parameter']}, causes "
        f"{100 * values['share']:.0f} % of the variance of predictions, and this run reduces it to "
        f"{100 * values['remaining']:.0f} % of its value"
    )


def _more_runs(values: JSON) -> str:
    lacking = []
    if values["identify"]:
        there = "one" if values["conditions"] else "none"
        lacking.append(f"at least two conditions for identification, each repeated (the batch has {there})")
    if values["validate"]:
        lacking.append("at least one held-out condition (role validate), repeated")
    return "cut " + ", and ".join(lacking)


SENTENCES: Mapping[str, Sentence] = {
    "decide": _decide,
    "decides": _decides,
    "nearly_decides": _nearly_decides,
    "own_experiments": _own_experiments,
    "none_decides": _none_decides,
    "describe": _describe,
    "describe_again": _describe_again,
    "show": _show,
    "would_show": _would_show,
    "none_shows": _none_shows,
    "tightens": _tightens,
    "more_runs": _more_runs,
    "correct_first": "correct the declaration as proposed on page one and run the batch again; no new cut "
    "is needed before that",
}
