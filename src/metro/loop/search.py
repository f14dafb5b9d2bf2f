"""The search: which effects, if any, the residual of an observable is traced to.

Forward: each effect of the library is fitted jointly with what the model has already; the best that passes
every gate is added. Backward: an effect that a later one made idle is dropped for good. Then each is weighed
against its rivals. The validation runs are not read here.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from metro.effects.effect import Effect, fitted_to
from metro.loop import signature as rest
from metro.loop.between import Between, between_conditions
from metro.loop.candidate import Candidate
from metro.loop.evidence import compare, dimmed, hold_out, leave_out, surviving_share
from metro.loop.fit import Fit, fit
from metro.loop.noise import Noise, first_noise
from metro.loop.restless import Restless, restless
from metro.loop.rivals import Rival, believed, contested
from metro.loop.session import Step, scan
from metro.loop.trial import Gates, Trial, tried, without
from metro.observables.problem import Problem
from metro.units import printed

__all__ = ["Gates", "Outcome", "Trial", "search"]

MOST_EFFECTS = 4
NOT_VISIBLE = 0.02
ABSORBED = "the base parameters imitate all but {:.1f} % of its signature"
DIM = 0.1
HIDDEN = "the zeros of each run (its offset, its place) take all but {:.1f} % of it: it shows from {} on"
UNBELIEVED = "more stays unexplained with it than it explains"
EVEN = 0.5  # least share explained by effects that are claimed
SESSION = 0.005  # p-value of a step along the session that counts
SESSION_SIZE = 0.01
CONDITIONS = 0.001  # p-value of differences between conditions that count
RUNS = 0.001  # p-value of a scatter between runs that counts


@dataclass(frozen=True)
class Outcome:
    """What the search found, for the verdict and the report.

    ``base`` and ``final`` are fits of the identification runs; ``steps`` the fits after each addition;
    ``trials`` the last trial of each effect, ``weight`` the probability of each effect found against its
    rivals and against nothing; ``rivals`` effects that explain the rest as well as a chosen one; ``lines``
    the signature of the rest, ``step`` that along the session, ``between`` that from condition to condition,
    ``restless`` that from run to run (of the base: ``base_between``, ``base_restless``); ``not_visible`` why
    effects cannot be seen, ``dim`` why others can only where they are large; ``seen`` those that can, fitted
    to the batch; ``prior`` the noise before anything was known; ``likeness`` the fit with what the rest
    resembles and is no effect of the library (``final`` is without).
    """

    base: Fit
    final: Fit
    steps: tuple[Fit, ...]
    trials: tuple[Trial, ...]
    weight: dict[str, float]
    rivals: tuple[Rival, ...]
    base_lines: tuple[rest.Line, ...]
    lines: tuple[rest.Line, ...]
    seen: tuple[Effect, ...]
    prior: Noise
    step: Step | None = None
    base_between: Between | None = None
    between: Between | None = None
    base_restless: Restless | None = None
    restless: Restless | None = None
    offered: tuple[Effect, ...] = ()
    not_visible: dict[str, str] = field(default_factory=dict)
    dim: dict[str, str] = field(default_factory=dict)
    likeness: Fit | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects found, in the order of their addition."""
        return tuple(effect.name for effect in self.final.candidate.effects)

    @property
    def explained(self) -> float:
        """Share of the significant rest of the base model, within and between runs, that effects took."""
        left, first = (
            rest.share_left(lines) ** 2 + sum(found.relative**2 for found in others if found)
            for lines, *others in (
                (self.lines, self.between, self.restless),
                (self.base_lines, self.base_between, self.base_restless),
            )
        )
        return 1.0 - left / max(first, left) if left else 1.0

    def probability(self, name: str) -> float:
        """Return the probability that an effect found is the cause.

        Its weight against its rivals and against nothing; where a significant rest stays, the library lacks
        a cause, and what is missing may have lent the effect its part: the weight counts by the share
        explained.
        """
        return self.weight[name] * self.explained


def search(problem: Problem, library: Sequence[Effect], gates: Gates) -> Outcome:
    """Search the library for the effects that a problem's base model lacks, on identification runs alone."""
    effects, unable = fitted_to(tuple(library), problem)
    blocks = problem.role("identify", "calibrate")
    prior = first_noise(gates.model_form_budget, problem.scatter, blocks)
    base = fit(Candidate(problem.base), blocks, prior)
    least = max(gates.materiality, 2.0 * problem.systematic)
    visible = {
        e.key: surviving_share(Candidate(problem.base, (e,)), base) for e in effects if not e.resembled
    }
    seen = [effect for effect in effects if visible.get(effect.key, 1.0) >= NOT_VISIBLE]
    absorbed = {
        name: ABSORBED.format(100.0 * share)
        for (name, _), share in visible.items()
        if name not in {effect.name for effect in seen}
    }
    current, steps = base, []
    trials: dict[tuple[str, str], Trial] = {}
    barred: set[str] = set()
    while len(current.candidate.effects) < MOST_EFFECTS:
        taken = {effect.name for effect in current.candidate.effects} | barred
        open_effects = [effect for effect in seen if effect.name not in taken]
        round_trials = tried(current, open_effects, prior, gates, least)
        trials |= {trial.effect.key: trial for trial in round_trials}
        passed = [trial for trial in round_trials if not trial.why_not]
        if not passed:
            break
        first = max(passed, key=lambda trial: believed(trial.effect, trial.weight))
        current, dropped = _pruned(first.fit, prior, gates, least)
        barred |= dropped
        steps.append(current)
    compared = contested(current, seen, prior, gates)
    if compared.final is not current:
        current, dropped = _pruned(compared.final, prior, gates, least)
        compared = contested(current, seen, prior, gates) if dropped else compared
    likeness = compared.final
    kept = tuple(effect for effect in likeness.candidate.effects if not effect.resembled)
    final = likeness if len(kept) == len(likeness.candidate.effects) else without(likeness, kept, prior)
    steps = [fitted for fitted in steps if not any(e.resembled for e in fitted.candidate.effects)]
    if final not in (base, *steps):
        steps.append(final)
    step, floor = scan(likeness, gates.seed), max(least, gates.model_form_budget)
    outcome = Outcome(
        base=base,
        final=final,
        steps=tuple(steps),
        trials=_foremost(trials.values(), final),
        weight=compared.weight,
        rivals=compared.rivals,
        base_lines=tuple(rest.signature(base, floor)),
        lines=tuple(rest.signature(final, floor)),
        seen=tuple(seen),
        prior=prior,
        step=step if step and step.p_value < SESSION and abs(step.relative) > SESSION_SIZE else None,
        base_between=_differing(base, floor),
        between=_differing(likeness, floor),
        base_restless=_unsteady(base, prior, floor),
        restless=_unsteady(likeness, prior, floor),
        offered=tuple(library),
        not_visible=unable | absorbed,
        dim=_dim(base, seen),
        likeness=likeness if likeness is not final else None,
    )
    return outcome if outcome.rivals or outcome.explained > EVEN else withdrawn(outcome, UNBELIEVED)


def _dim(base: Fit, effects: Iterable[Effect]) -> dict[str, str]:
    """Say of which effects the zeros of the runs leave little, and from which size they show.

    Those sought among many places are left out: their first parameter is a place, no size.
    """
    words: dict[str, str] = {}
    for effect in effects:
        if effect.resembled or effect.sought > 1.0:
            continue
        left = dimmed(Candidate(base.candidate.base, (effect,)), base)
        if left.share < DIM:
            words[effect.name] = HIDDEN.format(
                100.0 * left.share, f"{left.least:.2g} {printed(effect.parameters[0].unit)}".rstrip()
            )
    return words


def withdrawn(outcome: Outcome, why: str) -> Outcome:
    """Return an outcome without effects: a correction that is less likely than not is not applied."""
    return replace(
        outcome,
        final=outcome.base,
        steps=(),
        rivals=(),
        trials=tuple(
            replace(trial, why_not=why) if trial.effect.name in outcome.names else trial
            for trial in outcome.trials
        ),
        weight={},
        lines=outcome.base_lines or outcome.lines,  # what only the effect laid bare is there all the same
        between=outcome.base_between or outcome.between,
        restless=outcome.base_restless or outcome.restless,
    )


def _foremost(trials: Iterable[Trial], final: Fit) -> tuple[Trial, ...]:
    """Return one trial of each effect: of its forms, the one that was added or came nearest to it."""
    added = {effect.key for effect in final.candidate.effects}
    best: dict[str, Trial] = {}
    for trial in trials:
        name, rank = trial.effect.name, _rank(trial, added)
        if name not in best or rank > _rank(best[name], added):
            best[name] = trial
    return tuple(best.values())


def _rank(trial: Trial, added: set[tuple[str, str]]) -> tuple[bool, float, float]:
    return trial.effect.key in added, trial.weight, trial.fit.total


def _differing(fitted: Fit, least: float) -> Between | None:
    """Return how the conditions differ, where that counts."""
    found = between_conditions(fitted)
    return found if found and found.p_value < CONDITIONS and found.relative > least else None


def _unsteady(fitted: Fit, prior: Noise, least: float) -> Restless | None:
    """Return how the runs scatter, where that is beyond the usual and counts."""
    found = restless(fitted, prior)
    return found if found and found.p_value < RUNS and found.relative > least else None


def _pruned(current: Fit, prior: Noise, gates: Gates, least: float) -> tuple[Fit, set[str]]:
    """Drop effects that the latest addition made idle."""
    dropped: set[str] = set()
    for effect in current.candidate.effects[:-1]:
        kept = tuple(e for e in current.candidate.effects if e is not effect)
        smaller = without(current, kept, prior)
        evidence = compare(smaller, current)
        if evidence.size >= least:
            evidence = hold_out(evidence, leave_out(smaller, prior), current, prior)
        if evidence.gain < gates.held_out_gain:
            current, dropped = smaller, dropped | {effect.name}
    return current, dropped
