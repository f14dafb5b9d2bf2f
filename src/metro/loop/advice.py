"""What to measure next, in words: one paragraph for the engineer who plans the next session."""

from __future__ import annotations

from collections.abc import Sequence

from metro.effects.effect import Effect
from metro.loop import signature as rest
from metro.loop.experiment import Prospect, best_view, prospects
from metro.loop.fit import Fit
from metro.loop.rivals import Rival
from metro.loop.search import Outcome
from metro.observables.problem import Block, Problem, Proposal
from metro.units import Array, printed, printed_name

LEAST_RUNS = 2  # to identify on
WORTH = 0.5  # probability of deciding below which a run is not worth naming


def next_experiment(problem: Problem, outcome: Outcome, left: str, told_by: Fit) -> str | None:
    """Say what to measure next; None where nothing is open.

    An undecided cause comes first, then what is ``left`` unexplained, ``told_by`` the runs of a fit, then
    what these runs cannot show.
    """
    if outcome.rivals:
        return _to_decide(problem, outcome)
    if left:
        return _to_describe(told_by, left)
    if outcome.not_visible:
        return _to_show(problem, outcome)
    return None


def more_runs(problem: Problem) -> str:
    """Say which runs are lacking before anything can be told."""
    conditions = len({block.condition for block in problem.role("identify")})
    lacking = []
    if len(problem.role("identify")) < LEAST_RUNS:
        there = "one there is" if conditions else "there is none"
        lacking.append(f"at least two conditions to identify on, each repeated ({there} now)")
    if not problem.role("validate"):
        lacking.append("at least one condition that no fit sees (role validate), repeated")
    return "cut " + ", and ".join(lacking)


def enough_runs(problem: Problem) -> bool:
    """Whether there are runs to fit and runs to judge by."""
    return len(problem.role("identify")) >= LEAST_RUNS and bool(problem.role("validate"))


def left_over(outcome: Outcome) -> str:
    """Describe the significant rest, and what it resembles; empty where there is none."""
    parts = [f"like a {_resembled(outcome.likeness)}"] if outcome.likeness else []
    parts += [
        f"it may be no {_words(rival.found)} but a {_resembled(rival.fit)}"
        for rival in outcome.rivals
        if rival.fit.candidate.effects[-1].resembled
    ]
    parts.append(rest.in_words(outcome.lines))
    if outcome.step:
        step = outcome.step
        parts.append(f"a step of {step.parameter} by {100 * step.relative:+.1f} % after run {step.after}")
    if outcome.between:
        between = outcome.between
        parts.append(
            f"the base parameters differ between conditions by {100 * between.relative:.2g} % of the signal, "
            f"more than repeats scatter, most in {between.condition}"
        )
    if outcome.restless:
        restless = outcome.restless
        parts.append(
            f"runs scatter by {100 * restless.relative:.2g} % of the signal, {restless.times:.0f} times what "
            "is usual: something changes from run to run (a drift, another clamping)"
        )
    return "; ".join(part for part in parts if part)


def _resembled(likeness: Fit) -> str:
    """Name what is not of the library and would lower the rest, with the values that do it best."""
    found = [
        f"{_words(effect.name)} ({', '.join(_values(effect, likeness.theta[place]))})"
        for effect, place in likeness.candidate.parts(likeness.theta)
        if effect.resembled
    ]
    return f"{' and a '.join(found)}, which is no effect of the library"


def _values(effect: Effect, theta: Array) -> list[str]:
    return [
        f"{printed_name(one.name, one.unit)} {value:.3g} {printed(one.unit)}".rstrip()
        for one, value in zip(effect.reported, (effect.matrix @ theta).tolist(), strict=True)
    ]


def _to_decide(problem: Problem, outcome: Outcome) -> str:
    """Name the runs that tell the rivals apart, as few proposals as will do."""
    open_rivals = sorted(outcome.rivals, key=lambda rival: -rival.weight)
    parts = []
    while open_rivals:
        chosen = _best_for(problem, outcome, open_rivals)
        decided = {rival: prospect for rival, prospect in chosen if prospect.decides}
        if not decided:
            break
        repeats = max(prospect.repeats for prospect in decided.values())
        pairs = " and ".join(
            f"{pair_in_words(rival)} with a probability of {chance_in_words(prospect.probability)}"
            for rival, prospect in decided.items()
        )
        parts.append(f"{_cut(chosen[0][1].proposal, repeats)}: this tells {pairs}")
        open_rivals = [rival for rival in open_rivals if rival not in decided]
    return "; ".join(parts + ([_undecided(problem, outcome, open_rivals)] if open_rivals else []))


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
    """Return what each feasible run promises for telling a rival from what was found, the best first."""
    return prospects(outcome.final, rival.fit, problem.feasible)


def _of(proposal: Proposal, found: Sequence[Prospect]) -> Prospect:
    return next(prospect for prospect in found if prospect.proposal is proposal)


def _undecided(problem: Problem, outcome: Outcome, rivals: Sequence[Rival]) -> str:
    """Say what comes nearest to deciding, or what the heaviest rivals' own experiments are."""
    first = rivals[0]
    best = next(iter(ranked(problem, outcome, first)), None)
    if best and best.probability >= WORTH:
        pair = pair_in_words(first)
        return (
            f"{_cut(best.proposal, best.repeats)}: the best of the runs tried to tell {pair}, "
            f"but it decides with a probability of {chance_in_words(best.probability)} only"
        )
    plain = {name.partition(" (")[0] for name in first.pair}
    texts = {effect.name: effect.experiment for effect in outcome.offered if effect.name in plain}
    names = " or ".join(pair_in_words(rival) for rival in rivals)
    tried = f"no run of the kinds tried tells {names}; " if problem.feasible else ""
    return tried + "; or ".join(f"for {_words(name)}: {text}" for name, text in texts.items())


def _to_describe(fitted: Fit, left: str) -> str:
    """Name the condition whose rest is largest against the noise."""
    worst = most_left(fitted).condition
    return f"condition {worst} again, its repeats spread over the session, to describe what is left: {left}"


def most_left(fitted: Fit) -> Block:
    """Return a run of the condition whose rest is largest against the noise."""
    chi2: dict[str, float] = {}
    elements: dict[str, int] = {}
    for block in fitted.blocks:
        if block.role != "calibrate":
            chi2[block.condition] = chi2.get(block.condition, 0.0) + fitted.chi2[block.run]
            elements[block.condition] = elements.get(block.condition, 0) + fitted.elements[block.run]
    worst = max(chi2, key=lambda name: chi2[name] / elements[name])
    return next(block for block in fitted.blocks if block.condition == worst)


def _to_show(problem: Problem, outcome: Outcome) -> str:
    """Name runs that would show hidden effects; where none does, one effect's own experiment."""
    by_words: dict[str, list[str]] = {}
    hidden: list[str] = []
    experiments = {effect.name: effect.experiment for effect in outcome.offered}
    for name in outcome.not_visible:
        forms = [effect for effect in outcome.offered if effect.name == name]
        view = best_view(problem, outcome.base, forms)
        if view:
            by_words.setdefault(view.proposal.words, []).append(name)
        else:
            hidden.append(name)
    parts = [f"to see {listed(names)}: {words}" for words, names in by_words.items()]
    if hidden:
        parts.append(f"to see {_words(hidden[0])}: {experiments[hidden[0]]}")
    if len(hidden) > 1:
        parts.append(f"no run of the kinds tried shows {listed(hidden[1:])}")
    return "; ".join(parts)


def _cut(proposal: Proposal, repeats: int) -> str:
    return proposal.words if repeats == 1 else f"{proposal.words}, {repeats} times"


def pair_in_words(rival: Rival) -> str:
    """Name what was found and its rival."""
    return f"{_words(rival.found)} from {_words(rival.other)}"


def listed(names: Sequence[str]) -> str:
    """Name effects in a row."""
    *first, last = map(_words, names)
    return f"{', '.join(first)} and {last}" if first else last


def _words(name: str) -> str:
    return name.replace("_", " ")


def chance_in_words(probability: float) -> str:
    """Write a probability so that none is one."""
    return "more than 0.99" if probability > 0.99 else f"{probability:.2f}"
