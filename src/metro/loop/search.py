"""The search: which effects, if any, the residual of an observable is traced to.

Forward: each effect of the library is fitted jointly with what the model has already; the best that passes
every gate is added. Backward: an effect that a later one made idle is dropped for good. The validation runs
are not read here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from metro.effects.effect import Effect
from metro.loop import signature as rest
from metro.loop.candidate import Candidate
from metro.loop.evidence import Evidence, compare, hold_out, leave_out, surviving_share, weights
from metro.loop.fit import Fit, fit
from metro.loop.noise import Noise, first_noise
from metro.observables.problem import Problem

MOST_EFFECTS = 4
LEAST_BETTER = 0.4
RIVAL_WEIGHT = 0.05
NOT_VISIBLE = 0.02


@dataclass(frozen=True)
class Gates:
    """Thresholds of the configuration.

    Attributes
    ----------
    model_form_budget : relative to the signal.
    materiality : least relative change of the prediction.
    false_additions : rate of false discoveries over the candidates.
    held_out_gain : least gain in log-likelihood on conditions left out.
    seed : of the bootstraps.
    """

    model_form_budget: float
    materiality: float
    false_additions: float
    held_out_gain: float
    seed: int


@dataclass(frozen=True)
class Trial:
    """One effect tried on top of those already chosen."""

    effect: Effect
    fit: Fit
    evidence: Evidence
    q_value: float = 1.0
    weight: float = 0.0
    why_not: str = ""


@dataclass(frozen=True)
class Outcome:
    """What the search found, for the verdict and the report.

    ``base`` and ``final`` are fits of the identification runs; ``steps`` the fits after each addition;
    ``trials`` the last trial of each effect; ``rivals`` effects that explain the rest as well as a chosen
    one; ``lines`` the signature of the rest.
    """

    base: Fit
    final: Fit
    steps: tuple[Fit, ...]
    trials: tuple[Trial, ...]
    rivals: tuple[tuple[str, str], ...]
    lines: tuple[rest.Line, ...]
    not_visible: dict[str, float] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects found, in the order of their addition."""
        return tuple(effect.name for effect in self.final.candidate.effects)


def search(problem: Problem, library: Sequence[Effect], gates: Gates) -> Outcome:
    """Search the library for the effects that a problem's base model lacks, on identification runs alone."""
    blocks = problem.role("identify", "calibrate")
    prior = first_noise(gates.model_form_budget, problem.scatter, blocks)
    base = fit(Candidate(problem.base), blocks, prior)
    least = max(gates.materiality, 2.0 * problem.systematic)
    current, steps = base, []
    trials: dict[str, Trial] = {}
    rivals: list[tuple[str, str]] = []
    barred: set[str] = set()
    while len(current.candidate.effects) < MOST_EFFECTS:
        open_effects = [e for e in library if e not in current.candidate.effects and e.name not in barred]
        round_trials = _tried(current, open_effects, prior, gates, least)
        trials |= {trial.effect.name: trial for trial in round_trials}
        passed = sorted((t for t in round_trials if not t.why_not), key=lambda trial: -trial.weight)
        if not passed:
            break
        chosen = passed[0]
        rivals += [
            (chosen.effect.name, other.effect.name) for other in passed[1:] if other.weight > RIVAL_WEIGHT
        ]
        current, dropped = _pruned(chosen.fit, prior, gates, least)
        barred |= dropped
        steps.append(current)
    visible = {effect.name: surviving_share(Candidate(problem.base, (effect,)), base) for effect in library}
    return Outcome(
        base=base,
        final=current,
        steps=tuple(steps),
        trials=tuple(trials.values()),
        rivals=tuple(rivals),
        lines=tuple(rest.signature(current, max(least, gates.model_form_budget))),
        not_visible={name: share for name, share in visible.items() if share < NOT_VISIBLE},
    )


def _tried(current: Fit, effects: Sequence[Effect], prior: Noise, gates: Gates, least: float) -> list[Trial]:
    """Fit each effect jointly with what is there, compare, and apply the gates.

    Conditions are left out only for effects that pass the gates before.
    """
    trials = []
    for effect in effects:
        candidate = Candidate(current.candidate.base, (*current.candidate.effects, effect))
        larger = fit(candidate, current.blocks, prior, current)
        trials.append(Trial(effect, larger, compare(current, larger)))
    p_values = [trial.evidence.p_value for trial in trials]
    accepted = rest.discoveries(p_values, gates.false_additions)
    trials = [
        replace(
            trial,
            q_value=min(1.0, p * len(trials) / (1 + sum(other < p for other in p_values))),
            why_not=_why_not(trial.evidence, bool(found), least),
        )
        for trial, p, found in zip(trials, p_values, accepted, strict=True)
    ]
    return _held_out(current, trials, prior, gates)


def _held_out(current: Fit, trials: list[Trial], prior: Noise, gates: Gates) -> list[Trial]:
    """Apply the held-out gate, and weigh the candidates against each other and against adding nothing."""
    if all(trial.why_not for trial in trials):
        return trials
    out = leave_out(current, prior)
    trials = [
        trial if trial.why_not else replace(trial, evidence=hold_out(trial.evidence, out, trial.fit, prior))
        for trial in trials
    ]
    weighed = [trial for trial in trials if not trial.why_not]
    nothing = dict.fromkeys(out, 0.0)
    share = weights([nothing, *(trial.evidence.held_out for trial in weighed)], gates.seed)[1:]
    weight = {trial.effect.name: float(value) for trial, value in zip(weighed, share, strict=True)}
    return [
        replace(
            trial,
            weight=weight.get(trial.effect.name, 0.0),
            why_not=trial.why_not or _not_held_out(trial.evidence, gates),
        )
        for trial in trials
    ]


def _why_not(evidence: Evidence, found: bool, least: float) -> str:
    if not found:
        return f"no evidence: p = {evidence.p_value:.2g} over the runs of the fit"
    if evidence.size < least:
        return f"changes the prediction by {100 * evidence.size:.2f} %: below {100 * least:.2g} %, immaterial"
    return ""


def _not_held_out(evidence: Evidence, gates: Gates) -> str:
    if evidence.gain < gates.held_out_gain:
        needed = gates.held_out_gain
        return f"predicts left-out conditions no better: gain {evidence.gain:.1f}, {needed:g} needed"
    if evidence.better_share < LEAST_BETTER:
        return f"better in {100 * evidence.better_share:.0f} % of the left-out conditions only"
    return ""


def _pruned(current: Fit, prior: Noise, gates: Gates, least: float) -> tuple[Fit, set[str]]:
    """Drop effects that the latest addition made idle."""
    dropped: set[str] = set()
    for effect in current.candidate.effects[:-1]:
        kept = tuple(e for e in current.candidate.effects if e is not effect)
        smaller = _without(current, kept, prior)
        evidence = compare(smaller, current)
        if evidence.size >= least:
            evidence = hold_out(evidence, leave_out(smaller, prior), current, prior)
        if evidence.gain < gates.held_out_gain:
            current, dropped = smaller, dropped | {effect.name}
    return current, dropped


def _without(current: Fit, kept: tuple[Effect, ...], prior: Noise) -> Fit:
    """Refit with the effects that are kept, from the base up."""
    first = Candidate(current.candidate.base)
    fitted = fit(first, current.blocks, prior)
    for effect in kept:
        fitted = fit(
            Candidate(first.base, (*fitted.candidate.effects, effect)), current.blocks, prior, fitted
        )
    return fitted
