"""What a batch leaves open, and the runs that would close it, question after question.

What is undecided comes first, then the residual. Where neither is open: what these runs cannot
show, and the parameter that brings most of the error into predictions.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

from metro.loop.planning.decide import Kind, Pair, plan
from metro.loop.planning.experiment import TWICE, View, best_view
from metro.loop.planning.tighten import tighter
from metro.loop.search.outcome import Outcome
from metro.loop.search.trial import Gates
from metro.loop.statement import Statement
from metro.loop.verdict.advice import more_runs, to_decide
from metro.loop.verdict.residual import LEAST_RUNS, enough_runs, residual_of
from metro.loop.verdict.verification import held_out_error
from metro.observables.problem import Block, Made, Problem, Proposal
from metro.units import JSON

AGAIN = 3  # times that a condition is cut again whose residual is to be described
BETWEEN = 0.8  # feed of a condition that no fit sees, of that of the first run
HOPE = 0.05  # probability of deciding below which runs are not worth making

Question = Literal["decide", "describe", "show", "tighten", "enough"]


@dataclass(frozen=True)
class Aim:
    """A question that a batch leaves open, and the runs that would answer it.

    ``states`` both. ``kinds`` are empty where no run of the kinds tried would answer it; ``chance`` is the
    probability that the runs do, where there is one.
    """

    question: Question
    states: Statement
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
    problem : its ``feasible`` runs are those that may be made. outcome : of the search.
    """
    problem = replace(problem, feasible=tuple(one for one in problem.feasible if one.made))
    if not enough_runs(problem):
        return [_enough(problem)]
    if outcome.rivals:
        return [_decide(problem, outcome, gates, most)]
    residual = residual_of(problem, outcome, gates, held_out_error(problem, outcome))
    if residual.parts:
        again = _repeated(residual.worst(problem), min(AGAIN, most))
        condition = {"condition": again.proposal.words, "residual": residual.statement}
        return [Aim("describe", Statement("describe_again", condition), (again,))]
    showing = [*_show(problem, outcome, most)]
    return showing + _tighten(problem, outcome, most - sum(aim.runs for aim in showing))


def _repeated(block: Block, repeats: int) -> Kind:
    return Kind(Proposal(block.condition, (block,), (Made(block.run),)), repeats)


def _decide(problem: Problem, outcome: Outcome, gates: Gates, most: int) -> Aim:
    """Name the runs that distinguish what was chosen from its rivals."""
    rivals = {rival.pair: rival for rival in outcome.rivals}
    pairs = [Pair(names, outcome.final, rival.fit) for names, rival in rivals.items()]
    planned = plan(pairs, problem.feasible, outcome.prior, most, gates.seed)
    if planned is None or max(planned.chance.values()) < HOPE:
        return Aim("decide", Statement("none_decides", {"otherwise": to_decide(problem, outcome)}))
    decided = [{"pair": names, "probability": planned.chance[names]} for names in rivals]
    states = Statement("decides", {"runs": [_run(kind) for kind in planned.kinds], "pairs": decided})
    return Aim("decide", states, planned.kinds, min(planned.chance.values()))


def _run(kind: Kind) -> JSON:
    """Name runs of one kind, and how often they are made."""
    return {"proposal": kind.proposal.words, "repeats": kind.repeats}


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
            effects = {"effects": [view.effect for view in views], "probability": chance}
            yield Aim("show", Statement("would_show", {"run": _run(kind), **effects}), (kind,), chance)
    if hidden:
        yield Aim("show", Statement("none_shows", {"experiments": hidden}))


def _tighten(problem: Problem, outcome: Outcome, most: int) -> list[Aim]:
    best = tighter(problem, outcome.final, problem.feasible, most)
    if best is None:
        return []
    shares = {"parameter": best.parameter, "share": best.share, "remaining": best.left}
    return [Aim("tighten", Statement("tightens", {"run": _run(best.kind), **shares}), (best.kind,))]


def _enough(problem: Problem) -> Aim:
    """Name the runs that are lacking to identify anything: repeats, and a condition to judge by."""
    made = problem.role("identify")
    kinds: list[Kind] = []
    if len(made) < LEAST_RUNS:
        kinds += [_repeated(block, 1) for block in made]
    if made and not problem.role("validate"):
        held = Made(made[0].run, {"feed_per_tooth_mm": BETWEEN, "orbit_rpm": BETWEEN}, {"role": "validate"})
        words = f"{made[0].condition} at {BETWEEN:g} of its feed, held out"
        kinds.append(Kind(Proposal(words, (made[0],), (held,)), TWICE))
    return Aim("enough", more_runs(problem), tuple(kinds))
