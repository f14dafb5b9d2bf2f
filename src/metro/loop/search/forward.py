"""The strategy of the search: forward with backward elimination, then every effect against its rivals.

Forward: each effect of the library is fitted jointly with what the model has already; the best that passes
every gate is added. Backward: an effect that a later one made idle is dropped for good. Then each is weighed
against its rivals.
"""

from __future__ import annotations

from metro.effects.effect import Effect
from metro.loop.checks.evidence import compare, hold_out, leave_out
from metro.loop.fitting.fit import Fit
from metro.loop.search.rivals import believed, contested
from metro.loop.search.strategy import Choice, SearchSpace
from metro.loop.search.trial import Trial, tried, without

MOST_EFFECTS = 4


def forward(space: SearchSpace) -> Choice:
    """Add the best effect that passes every gate until none does, and weigh what was added."""
    current, steps, trials = _added(space)
    compared = contested(space.base, current, space.effects, space.prior, space.gates)
    if compared.final is not current:
        current, dropped = _pruned(compared.final, space)
        if dropped:
            compared = contested(space.base, current, space.effects, space.prior, space.gates)
    return Choice(compared.final, tuple(steps), tuple(trials.values()), compared.weight, compared.rivals)


def _added(space: SearchSpace) -> tuple[Fit, list[Fit], dict[tuple[str, str], Trial]]:
    """Add effects one by one; return the last fit, the fit after each addition, and the last trials."""
    current, steps = space.base, []
    trials: dict[tuple[str, str], Trial] = {}
    barred: set[str] = set()
    while len(current.candidate.effects) < MOST_EFFECTS:
        round_trials = tried(current, _open(current, barred, space), space.prior, space.gates, space.least)
        trials |= {trial.effect.key: trial for trial in round_trials}
        passed = [trial for trial in round_trials if not trial.why_not]
        if not passed:
            break
        first = max(passed, key=lambda trial: believed(trial.effect, trial.weight))
        current, dropped = _pruned(first.fit, space)
        barred |= dropped
        steps.append(current)
    return current, steps, trials


def _open(current: Fit, barred: set[str], space: SearchSpace) -> list[Effect]:
    """Return the effects that are neither in a fit nor barred."""
    taken = {effect.name for effect in current.candidate.effects} | barred
    return [effect for effect in space.effects if effect.name not in taken]


def _pruned(current: Fit, space: SearchSpace) -> tuple[Fit, set[str]]:
    """Drop effects that the latest addition made idle."""
    dropped: set[str] = set()
    for effect in current.candidate.effects[:-1]:
        kept = tuple(e for e in current.candidate.effects if e is not effect)
        smaller = without(space.base, kept, space.prior)
        evidence = compare(smaller, current)
        if evidence.size >= space.least:
            evidence = hold_out(evidence, leave_out(smaller, space.prior), current, space.prior)
        if evidence.gain < space.gates.held_out_gain:
            current, dropped = smaller, dropped | {effect.name}
    return current, dropped
