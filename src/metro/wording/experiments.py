"""What to measure next: which runs decide, describe, show or tighten what a batch leaves open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from metro.units import JSON
from metro.wording.candidates import Sentence
from metro.wording.names import chance, cut, listed, pair, plain


def _decide(values: JSON) -> str:
    return "; ".join(values["parts"])


def _decides(values: JSON) -> str:
    runs = " and ".join(map(cut, values["runs"]))
    return f"{runs}: this tells {_pairs(values['pairs'])}"


def _pairs(pairs: Sequence[JSON]) -> str:
    """Name pairs, each with the probability that it is decided."""
    return " and ".join(
        f"{pair(one['pair'])} with a probability of {chance(one['probability'])}" for one in pairs
    )


def _nearly_decides(values: JSON) -> str:
    return (
        f"{cut(values['run'])}: the best of the runs tried to tell {pair(values['pair'])}, "
        f"but it decides with a probability of {chance(values['probability'])} only"
    )


def _own_experiments(values: JSON) -> str:
    names = " or ".join(map(pair, values["pairs"]))
    tried = f"no run of the kinds tried tells {names}; " if values["tried"] else ""
    return tried + "; or ".join(f"for {plain(name)}: {text}" for name, text in values["experiments"].items())


def _none_decides(values: JSON) -> str:
    return f"no run that may be made tells the rivals apart; {values['otherwise']}"


def _describe(values: JSON) -> str:
    return (
        f"condition {values['condition']} again, its repeats spread over the session, to describe what is "
        f"left: {values['residual']}"
    )


def _describe_again(values: JSON) -> str:
    return f"condition {values['condition']} again, to describe what is left: {values['residual']}"


def _show(values: JSON) -> str:
    hidden = values["hidden"]
    parts = [f"to see {listed(one['effects'])}: {one['proposal']}" for one in values["shown"]]
    if hidden:
        parts.append(f"to see {plain(hidden[0])}: {values['experiment']}")
    if len(hidden) > 1:
        parts.append(f"no run of the kinds tried shows {listed(hidden[1:])}")
    return "; ".join(parts)


def _would_show(values: JSON) -> str:
    return (
        f"{cut(values['run'])}: this would show {listed(values['effects'])}, which these runs cannot, if of "
        f"the usual size with a probability of {chance(values['probability'])}"
    )


def _none_shows(values: JSON) -> str:
    experiments = values["experiments"]
    texts = "; ".join(f"for {plain(name)}: {text}" for name, text in experiments.items())
    return f"no run of the kinds tried shows {listed(list(experiments))}; {texts}"


def _tightens(values: JSON) -> str:
    return (
        f"{cut(values['run'])}: what is not known of the parameters, {values['parameter']} above all, makes "
        f"{100 * values['share']:.0f} % of the variance of predictions, and this leaves "
        f"{100 * values['remaining']:.0f} % of that"
    )


def _more_runs(values: JSON) -> str:
    lacking = []
    if values["identify"]:
        there = "one there is" if values["conditions"] else "there is none"
        lacking.append(f"at least two conditions to identify on, each repeated ({there} now)")
    if values["validate"]:
        lacking.append("at least one condition that no fit sees (role validate), repeated")
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
    "correct_first": "correct what the batch declares, as page one says, and run it again; no new cut is "
    "needed before that",
}
