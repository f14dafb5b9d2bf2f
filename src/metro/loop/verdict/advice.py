"""What to measure next: the proposals that decide, describe or show what a batch leaves open."""

from __future__ import annotations

from collections.abc import Sequence

from metro.loop.planning.experiment import Prospect, best_view, prospects
from metro.loop.search.outcome import Outcome
from metro.loop.search.rivals import Rival
from metro.loop.statement import Statement
from metro.loop.verdict.residual import LEAST_RUNS, Residual
from metro.observables.problem import Problem, Proposal

WORTH = 0.5  # probability of deciding below which a run is not worth naming


def next_experiment(problem: Problem, outcome: Outcome, residual: Residual) -> Statement | None:
    """State what to measure next; None where nothing is open.

    An undecided cause comes first, then the residual, then what these runs cannot show.
    """
    if outcome.rivals:
        return to_decide(problem, outcome)
    if residual.parts:
        values = {"condition": residual.worst(problem).condition, "residual": residual.statement}
        return Statement("describe", values)
    if outcome.not_visible:
        return _to_show(problem, outcome)
    return None


def more_runs(problem: Problem) -> Statement:
    """State which runs are lacking before anything can be identified."""
    runs = problem.role("identify")
    lacking = {"identify": len(runs) < LEAST_RUNS, "validate": not problem.role("validate")}
    return Statement("more_runs", {**lacking, "conditions": len({block.condition for block in runs})})


def to_decide(problem: Problem, outcome: Outcome) -> Statement:
    """Name the runs that distinguish the rivals, as few proposals as will do."""
    open_rivals = sorted(outcome.rivals, key=lambda rival: -rival.weight)
    parts = []
    while open_rivals:
        chosen = _best_for(problem, outcome, open_rivals)
        decided = {rival: prospect for rival, prospect in chosen if prospect.decides}
        if not decided:
            break
        pairs = [
            {"pair": rival.pair, "probability": prospect.probability} for rival, prospect in decided.items()
        ]
        repeats = max(prospect.repeats for prospect in decided.values())
        run = {"proposal": chosen[0][1].proposal.words, "repeats": repeats}
        parts.append(Statement("decides", {"runs": [run], "pairs": pairs}))
        open_rivals = [rival for rival in open_rivals if rival not in decided]
    return Statement(
        "decide", {"parts": parts + ([_undecided(problem, outcome, open_rivals)] if open_rivals else [])}
    )


def _best_for(problem: Problem, outcome: Outcome, rivals: Sequence[Rival]) -> list[tuple[Rival, Prospect]]:
    """Return the proposal that decides most of the rivals, and of those the one with the fewest runs."""
    choices = []
    for proposal in problem.feasible:
        seen = [(rival, _of(proposal, ranked(problem, outcome, rival))) for rival in rivals]
        decided = [prospect for _, prospect in seen if prospect.decides]
        runs = max((prospect.runs for prospect in decided), default=0)
        once = sum(prospect.once for _, prospect in seen)
        choices.append(((-len(decided), runs, -once), seen))
    return min(choices, key=lambda choice: choice[0])[1] if choices else []


def ranked(problem: Problem, outcome: Outcome, rival: Rival) -> tuple[Prospect, ...]:
    """Return what each feasible run promises for distinguishing a rival from what was chosen, best first."""
    return prospects(outcome.final, rival.fit, problem.feasible)


def _of(proposal: Proposal, promised: Sequence[Prospect]) -> Prospect:
    return next(prospect for prospect in promised if prospect.proposal is proposal)


def _undecided(problem: Problem, outcome: Outcome, rivals: Sequence[Rival]) -> Statement:
    """State what comes nearest to deciding, or what the heaviest rivals' own experiments are."""
    first = rivals[0]
    best = next(iter(ranked(problem, outcome, first)), None)
    if best and best.probability >= WORTH:
        run = {"proposal": best.proposal.words, "repeats": best.repeats}
        return Statement("nearly_decides", {"run": run, "pair": first.pair, "probability": best.probability})
    plain = {name.partition(" (")[0] for name in first.pair}
    experiments = {effect.name: effect.experiment for effect in outcome.offered if effect.name in plain}
    return Statement(
        "own_experiments",
        {
            "tried": bool(problem.feasible),
            "pairs": [rival.pair for rival in rivals],
            "experiments": experiments,
        },
    )


def _to_show(problem: Problem, outcome: Outcome) -> Statement:
    """Name runs that would show hidden effects; where none does, one effect's own experiment."""
    by_proposal: dict[str, list[str]] = {}
    hidden: list[str] = []
    experiments = {effect.name: effect.experiment for effect in outcome.offered}
    for name in outcome.not_visible:
        forms = [effect for effect in outcome.offered if effect.name == name]
        view = best_view(problem, outcome.base, forms)
        if view:
            by_proposal.setdefault(view.proposal.words, []).append(name)
        else:
            hidden.append(name)
    shown = [{"proposal": words, "effects": names} for words, names in by_proposal.items()]
    first = experiments[hidden[0]] if hidden else None
    return Statement("show", {"shown": shown, "hidden": hidden, "experiment": first})
