"""Trials: one effect fitted jointly with what a model has already, and the gates that it must pass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from metro.effects.effect import Effect
from metro.loop import signature as rest
from metro.loop.candidate import Candidate
from metro.loop.evidence import Evidence, compare, hold_out, leave_out, missed, weights
from metro.loop.fit import Fit, fit
from metro.loop.noise import Noise
from metro.observables.problem import Block, Limited
from metro.units import Array

LEAST_BETTER = 0.4
HALF_INTERVAL = 2.0  # standard deviations: half a 95 % interval
OF_THE_REST = 0.5  # an effect smaller than this share of what stays unexplained may be part of that
UNLIKE = "no effect of the library, and it does not explain the rest either"


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


def tried(current: Fit, effects: Sequence[Effect], prior: Noise, gates: Gates, least: float) -> list[Trial]:
    """Fit each effect jointly with what is there, compare, and apply the gates.

    Conditions are left out only for effects that pass the gates before.
    """
    trials = []
    for effect in effects:
        candidate = Candidate(current.candidate.base, (*current.candidate.effects, effect))
        larger = fit(candidate, current.blocks, prior, current)
        trials.append(Trial(effect, larger, compare(current, larger)))
    p_values = [trial.evidence.p_value for trial in trials]
    q_values = rest.q_values(p_values)
    trials = [
        replace(
            trial,
            q_value=float(q),
            why_not=unsettled(trial.fit)
            or _why_not(trial.evidence, float(q), gates, least)
            or (UNLIKE if unlike(trial.effect, trial.fit) else ""),
        )
        for trial, q in zip(trials, q_values, strict=True)
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
    odds = [1.0, *(trial.effect.odds for trial in weighed)]
    gains = [nothing, *(trial.evidence.held_out for trial in weighed)]
    share = weights(gains, gates.seed, prior=odds)[1:]
    weight = {trial.effect.key: float(value) for trial, value in zip(weighed, share, strict=True)}
    return [
        replace(
            trial,
            weight=weight.get(trial.effect.key, 0.0),
            why_not=trial.why_not or _not_held_out(trial.evidence, gates),
        )
        for trial in trials
    ]


def unsettled(fitted: Fit) -> str:
    """Say why a fit is no result, if it is none.

    It did not converge, or tells no parameter of an effect, or these would have to be larger than they may
    be, or its model does not hold there.
    """
    if not fitted.converged:
        by = f"{fitted.step:.2g}" if fitted.step < 99.5 else f"{fitted.step:.0f}"
        return f"its fit did not converge: a step more would move a parameter by {by} of its sd"
    variance = np.diag(fitted.covariance)[len(fitted.beta) :] * fitted.dispersion
    half = HALF_INTERVAL * np.sqrt(np.maximum(variance, 0.0))
    parts = fitted.candidate.parts(fitted.theta)
    reasons = (_untold(effect, fitted.theta[place], half[place]) for effect, place in parts)
    return next(filter(None, reasons), "") or beyond(fitted, fitted.blocks)


def _untold(effect: Effect, value: Array, half: Array) -> str:
    """Say why no parameter of an effect is told: its interval is all that it may be, or it is at the end."""
    reason = "these runs do not determine its parameters"
    for parameter, at, width in zip(effect.parameters, value.tolist(), half.tolist(), strict=True):
        if parameter.period is not None:
            told = 2.0 * width < parameter.period
        else:
            told = at - width > parameter.lower or at + width < parameter.upper
            if told and at in {parameter.lower, parameter.upper} - {parameter.neutral}:
                reason, told = f"its {parameter.name} would be beyond {at:g}, which is not plausible", False
        if told:
            return ""
    return reason


def beyond(fitted: Fit, blocks: Sequence[Block]) -> str:
    """Name the first of ``blocks`` for which a fitted model has no prediction, and why; empty: none."""
    model = fitted.candidate.model(fitted.theta)
    if not isinstance(model, Limited):
        return ""
    reasons = ((block.run, model.beyond(block, fitted.beta)) for block in blocks)
    return next((f"in {run} {reason}" for run, reason in reasons if reason), "")


def _why_not(evidence: Evidence, q: float, gates: Gates, least: float) -> str:
    if q > gates.false_additions:
        told = f"no evidence: p = {evidence.p_value:.2g} over the runs of the fit"
        by_chance = f", which one of so many reaches by chance (q = {q:.2g})"
        return told + (by_chance if evidence.p_value <= gates.false_additions else "")
    if evidence.size < least:
        return f"changes the prediction by {100 * evidence.size:.2f} %: below {100 * least:.2g} %, immaterial"
    if evidence.size < OF_THE_REST * evidence.missed:
        return (
            f"changes the prediction by {100 * evidence.size:.2g} %, where {100 * evidence.missed:.2g} % "
            "stay unexplained: what is missing may look like it"
        )
    return ""


def _not_held_out(evidence: Evidence, gates: Gates) -> str:
    if evidence.gain < gates.held_out_gain:
        needed = gates.held_out_gain
        return f"predicts left-out conditions no better: gain {evidence.gain:.1f}, {needed:g} needed"
    if evidence.better_share < LEAST_BETTER:
        return f"better in {100 * evidence.better_share:.0f} % of the left-out conditions only"
    return ""


def unlike(effect: Effect, fitted: Fit) -> bool:
    """Whether an effect that is not of the library leaves a rest that stands out: no likeness then.

    Where much stays unexplained, what has more freedom comes nearer to it, whatever the cause.
    """
    budget = fitted.noise.budget
    return (
        effect.resembled and missed(fitted) > budget and bool(rest.share_left(rest.signature(fitted, budget)))
    )


def without(current: Fit, kept: tuple[Effect, ...], prior: Noise) -> Fit:
    """Refit with the effects that are kept, from the base up."""
    first = Candidate(current.candidate.base)
    fitted = fit(first, current.blocks, prior)
    for effect in kept:
        fitted = fit(
            Candidate(first.base, (*fitted.candidate.effects, effect)), current.blocks, prior, fitted
        )
    return fitted
