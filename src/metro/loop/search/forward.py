"""The strategy of the search: forward with backward elimination, then every effect against its rivals.

Forward: each effect of the library is fitted jointly with what the model has already; the best that passes
every gate is added. An effect that is small beside what stays unexplained may be a part of that: where no
other is left it is added on trial, and in the end only those stay that are not small beside what the whole
model leaves. (Several causes of one size hide each other otherwise.) Backward: an effect that a later one
made idle is dropped for good. Then each is weighed against its rivals.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Set
from dataclasses import replace

from metro.effects.effect import Effect
from metro.loop.checks.evidence import Evidence, compare, hold_out, leave_out
from metro.loop.fitting.fit import Fit
from metro.loop.search.replaceable import is_needed
from metro.loop.search.rivals import Contest, believed, contested
from metro.loop.search.significance import least_significant
from metro.loop.search.strategy import Choice, SearchSpace
from metro.loop.search.trial import (
    HOPELESS,
    Trial,
    immaterial,
    parted,
    small_beside_residual,
    tried,
    without,
)
from metro.loop.statement import Statement

SIGNIFICANT = (
    0.05  # p-value of an effect by its own interval, above which that holds none: the 95 % of intervals
)
MUCH = 0.1  # of the signal, by which an effect moves the prediction whatever its interval holds
WORST = 2.0  # standard deviations: all that is missed has the shape of the effect, in every condition
MOST_EFFECTS = 6  # of a model: four that every machine has (runout, end, resonance, crosstalk), and two
# Trials by what a model has, in whatever order it was added, and what was tried on top of that.
Known = dict[tuple[frozenset[Effect], tuple[tuple[str, str], ...]], list[Trial]]


def forward(space: SearchSpace) -> Choice:
    """Add the best effect that passes every gate until none does, and weigh what was added.

    Where a rival takes the place of an effect, others may explain what it leaves: they are tried again. No
    set of effects is looked at twice, whether it was weighed or came out of a contest: gates that contradict
    each other would lead around for ever. What something that is too small to be claimed explains as well is
    not claimed either.
    """
    current, steps = space.base, list[Fit]()
    trials: dict[tuple[str, str], Trial] = {}
    contest: Contest | None = None
    weighed: set[frozenset[Effect]] = set()
    known: Known = {}
    aside: tuple[Effect, ...] = ()
    replaced: set[str] = set()
    while True:
        grown, further, latest = _added(current, space, known, replaced)
        steps, trials = steps + further, trials | latest
        kept, small = _large_enough(grown, space)
        trials |= {key: replace(trials[key], why_not=why) for key, why in small.items()}
        if contest is not None and grown is current:
            if not small:
                break
            gone = {*aside, *grown.candidate.effects} - {*kept.candidate.effects}
            replaced |= {effect.name for effect in gone}
            current, contest = kept, None
            continue
        current = kept
        contest = contested(space.base, current, space.effects, space.prior, space.gates)
        weighed.add(frozenset(current.candidate.effects))
        better = contest.final
        if frozenset(better.candidate.effects) in weighed:
            break
        weighed.add(frozenset(better.candidate.effects))
        aside = current.candidate.effects
        current, dropped = _pruned(better, space)
        contest = None if dropped else contest
    chosen = set(contest.final.candidate.effects)
    steps = [step for step in steps if set(step.candidate.effects) <= chosen]
    return Choice(contest.final, tuple(steps), tuple(trials.values()), contest.weight, contest.rivals)


def _added(
    current: Fit, space: SearchSpace, known: Known, replaced: Set[str] = frozenset()
) -> tuple[Fit, list[Fit], dict[tuple[str, str], Trial]]:
    """Add effects to a fit one by one; return the last fit, that after each addition, and the last trials.

    Effects that gained no more than chance does in the round before wait until no other may be added at once.
    ``known``: trials that were made, to which those made here are added. ``replaced``: effects that may not
    be added, since something too small to be claimed explains as much.
    """
    steps: list[Fit] = []
    trials: dict[tuple[str, str], Trial] = {}
    barred = set(replaced)
    while len(current.candidate.effects) < MOST_EFFECTS:
        effects = _open(current, barred, space)
        passed: list[Trial] = []
        for several in (_promising(effects, trials), effects):
            asked = frozenset(current.candidate.effects), tuple(effect.key for effect in several)
            if asked not in known:
                known[asked] = tried(current, several, space.prior, space.gates, space.least)
            round_trials = known[asked]
            open_to = [trial for trial in round_trials if not trial.why_not]
            passed = [trial for trial in open_to if not trial.beside]
            if passed:
                break
        trials |= {trial.effect.key: trial for trial in round_trials}
        passed = passed or open_to
        if not passed:
            break
        first = max(passed, key=lambda trial: believed(trial.effect, trial.weight, trial.fit))
        current, dropped = _pruned(first.fit, space)
        barred |= dropped
        steps.append(current)
    return current, steps, trials


def _promising(effects: list[Effect], trials: Mapping[tuple[str, str], Trial]) -> list[Effect]:
    """Return the effects that gained more than chance does, where they were tried last, or were not tried.

    Those that were not followed to their end, since another one was far ahead, may have gained as well. By
    chance, twice the log-likelihood gains one for each parameter: the mean of chi-squared.
    """
    return [
        effect
        for effect in effects
        if effect.key not in trials
        or trials[effect.key].evidence.statistic > len(effect.parameters)
        or _given_up(trials[effect.key])
    ]


def _given_up(trial: Trial) -> bool:
    """Whether an effect was not followed to its end, since another one was far ahead."""
    return getattr(trial.why_not, "code", "") == "far_behind" and not trial.fit.converged


def _large_enough(current: Fit, space: SearchSpace) -> tuple[Fit, dict[tuple[str, str], Statement]]:
    """Drop effects that are not significant by their own intervals, or small beside what stays unexplained.

    Also those that are too small to matter beside the others, whatever they were before these were there.
    The least significant goes first, then the smallest; it is said why of each. The intervals of few runs
    that a model misses by a fifth hold almost anything, since what is missed counts there as a dozen equal
    pieces: an effect stays that moves the prediction by more than all that the model misses and may get
    wrong could, were it of the effect's own shape.
    """
    dropped: dict[tuple[str, str], Statement] = {}
    while current.candidate.effects:
        evidences = {
            effect: compare(*parted(space.base, current, effect, space.prior))
            for effect in current.candidate.effects
        }
        least, p_value = least_significant(current)
        why: Statement | None = Statement("holds_nothing", {"p_value": p_value})
        if p_value <= SIGNIFICANT or _exceeds_all_missed(evidences[least], current.noise.budget):
            least = min(evidences, key=lambda effect: evidences[effect].size)
            why = small_beside_residual(evidences[least]) or immaterial(evidences[least], space.least)
        if why is None:
            break
        dropped[least.key] = why
        kept = tuple(e for e in current.candidate.effects if e is not least)
        current = without(space.base, kept, space.prior)
    return current, dropped


def _exceeds_all_missed(evidence: Evidence, budget: float) -> bool:
    """Whether an effect is larger than what is missed could make it, if it is the same in all conditions.

    What is missed, of a share m of the signal, and the ``budget`` b of what no model gets right, have at most
    an effect of the size √(m² + b²), where they have its shape and nothing else; spread over other shapes,
    they have less. An effect that moves the prediction by much need only exceed what is missed. What it
    spares the base parameters moves nothing, and does not count.
    """
    largest = math.hypot(evidence.missed, budget)
    return evidence.moved > min(WORST * largest, max(MUCH, evidence.missed))


def _open(current: Fit, barred: set[str], space: SearchSpace) -> list[Effect]:
    """Return the effects that are neither in a fit nor barred."""
    taken = {effect.name for effect in current.candidate.effects} | barred
    return [effect for effect in space.effects if effect.name not in taken]


def _pruned(current: Fit, space: SearchSpace) -> tuple[Fit, set[str]]:
    """Drop effects that the latest addition made idle.

    On conditions left out, an effect gains what it gains on the runs of the fit less one for each of its
    parameters (Stone 1977, J. R. Stat. Soc. B 39, 44). Where that is far above what it must gain, no
    condition is left out here, and where it is so to first order, nothing is fitted: the contest with its
    rivals does that in the end.
    """
    dropped: set[str] = set()
    for effect in current.candidate.effects[:-1]:
        if is_needed(current, effect):
            continue
        smaller, current = parted(space.base, current, effect, space.prior)
        evidence = compare(smaller, current)
        expected = current.total - smaller.total - len(effect.parameters)
        if evidence.size >= space.least:
            if expected > space.gates.held_out_gain + HOPELESS:
                continue
            evidence = hold_out(evidence, leave_out(smaller, space.prior), current, space.prior)
        if evidence.gain < space.gates.held_out_gain:
            current, dropped = smaller, dropped | {effect.name}
    return current, dropped
