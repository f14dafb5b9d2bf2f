"""What a batch leaves open, and the runs that would close it, question after question.

What is undecided comes first, then what is left unexplained. Where neither is open: what these runs cannot
show, and the parameter that brings most of the error into predictions.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

from metro.loop.advice import (
    LEAST_RUNS,
    chance_in_words,
    enough_runs,
    listed,
    more_runs,
    most_left,
    next_experiment,
    pair_in_words,
)
from metro.loop.decide import Kind, Pair, plan
from metro.loop.experiment import TWICE, View, best_view
from metro.loop.search import Gates, Outcome
from metro.loop.tighten import tighter
from metro.loop.verdict import rest_of
from metro.observables.problem import Block, Made, Problem, Proposal

AGAIN = 3  # times that a condition is cut again whose rest is to be described
BETWEEN = 0.8  # feed of a condition that no fit sees, of that of the first run
HOPE = 0.05  # probability of deciding below which runs are not worth making

Question = Literal["decide", "describe", "show", "tighten", "enough"]


@dataclass(frozen=True)
class Aim:
    """A question that a batch leaves open, and the runs that would answer it.

    ``words`` say both. ``kinds`` are empty where no run of the kinds tried would answer it; ``chance`` is the
    probability that the runs do, where there is one.
    """

    question: Question
    words: str
    kinds: tuple[Kind, ...] = ()
    chance: float | None = None

    @property
    def runs(self) -> int:
        """Number of runs to be made."""
        return sum(kind.runs for kind in self.kinds)


def aims(problem: Problem, outcome: Outcome, gates: Gates, most: int) -> list[Aim]:
    """Return the open questions of an observable with at most so many runs; empty where nothing is open.

    Parameters
    ----------
    problem : its ``feasible`` runs are those that may be made. outcome : what the search found.
    """
    problem = replace(problem, feasible=tuple(one for one in problem.feasible if one.made))
    if not enough_runs(problem):
        return [_enough(problem)]
    if outcome.rivals:
        return [_decide(problem, outcome, gates, most)]
    left, told_by, _ = rest_of(problem, outcome, gates)
    if left:
        again = _repeated(most_left(told_by), min(AGAIN, most))
        words = f"condition {again.proposal.words} again, to describe what is left: {left}"
        return [Aim("describe", words, (again,))]
    found = [*_show(problem, outcome, most)]
    found += _tighten(problem, outcome, most - sum(aim.runs for aim in found))
    return found


def _repeated(block: Block, repeats: int) -> Kind:
    return Kind(Proposal(block.condition, (block,), (Made(block.run),)), repeats)


def _decide(problem: Problem, outcome: Outcome, gates: Gates, most: int) -> Aim:
    """Name the runs that tell what was found from its rivals."""
    rivals = {rival.pair: rival for rival in outcome.rivals}
    pairs = [Pair(names, outcome.final, rival.fit) for names, rival in rivals.items()]
    found = plan(pairs, problem.feasible, outcome.prior, most, gates.seed)
    if found is None or max(found.chance.values()) < HOPE:
        tried = "no run that may be made tells the rivals apart; "
        return Aim("decide", tried + (next_experiment(problem, outcome, "", outcome.final) or ""))
    cut = " and ".join(in_words(kind) for kind in found.kinds)
    told = " and ".join(
        f"{pair_in_words(rival)} with a probability of {chance_in_words(found.chance[names])}"
        for names, rival in rivals.items()
    )
    return Aim("decide", f"{cut}: this tells {told}", found.kinds, min(found.chance.values()))


def in_words(kind: Kind) -> str:
    """Name runs of one kind, and how often they are made."""
    return kind.proposal.words + (f", {kind.repeats} times" if kind.repeats > 1 else "")


def _show(problem: Problem, outcome: Outcome, most: int) -> Iterator[Aim]:
    """Name the runs that would show hidden effects, those that show most of them first."""
    by_proposal: dict[int, list[View]] = {}
    hidden: dict[str, str] = {}
    for name in outcome.not_visible:
        forms = [effect for effect in outcome.offered if effect.name == name]
        view = best_view(problem, outcome.base, forms)
        if view:
            by_proposal.setdefault(id(view.proposal), []).append(view)
        else:
            hidden[name] = forms[0].experiment
    for views in sorted(by_proposal.values(), key=len, reverse=True):
        kind = Kind(views[0].proposal, TWICE)
        chance = min(view.chance for view in views)
        if kind.runs <= most and chance >= HOPE:
            most -= kind.runs
            words = (
                f"{in_words(kind)}: this would show {listed([view.effect for view in views])}, which these "
                f"runs cannot, if of the usual size with a probability of {chance_in_words(chance)}"
            )
            yield Aim("show", words, (kind,), chance)
    if hidden:
        texts = "; ".join(f"for {listed([name])}: {text}" for name, text in hidden.items())
        yield Aim("show", f"no run of the kinds tried shows {listed(list(hidden))}; {texts}")


def _tighten(problem: Problem, outcome: Outcome, most: int) -> list[Aim]:
    found = tighter(problem, outcome.final, problem.feasible, most)
    if found is None:
        return []
    words = (
        f"{in_words(found.kind)}: what is not known of the parameters, {found.parameter} above all, makes "
        f"{100 * found.share:.0f} % of the variance of predictions, and this leaves {100 * found.left:.0f} % "
        "of that"
    )
    return [Aim("tighten", words, (found.kind,))]


def _enough(problem: Problem) -> Aim:
    """Name the runs that are lacking before anything can be told: repeats, and a condition to judge by."""
    made = problem.role("identify")
    kinds: list[Kind] = []
    if len(made) < LEAST_RUNS:
        kinds += [_repeated(block, 1) for block in made]
    if made and not problem.role("validate"):
        held = Made(made[0].run, {"feed_per_tooth_mm": BETWEEN, "orbit_rpm": BETWEEN}, {"role": "validate"})
        words = f"{made[0].condition} at {BETWEEN:g} of its feed, held out"
        kinds.append(Kind(Proposal(words, (made[0],), (held,)), TWICE))
    return Aim("enough", more_runs(problem), tuple(kinds))
