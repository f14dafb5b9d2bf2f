"""Trials: one effect fitted jointly with what a model has already, and the gates that it must pass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from metro.effects.effect import Effect
from metro.loop.checks import signature as residual
from metro.loop.checks.evidence import Evidence, compare, hold_out, leave_out, missed, weights
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Fit, Race, cost_under, fit
from metro.loop.fitting.noise import Noise
from metro.loop.fitting.nuisances import search_nuisance
from metro.loop.fitting.race import raced
from metro.loop.fitting.system import State, ahead, effect_slopes, linearised, normal_equations
from metro.loop.search.settled import beyond, beyond_left_out, unsettled
from metro.loop.statement import Statement

LEAST_BETTER = 0.4  # share of the left-out conditions that an effect must predict better
HOPELESS = 12.0  # log-likelihood on the runs of the fit by which an effect may be behind and still be weighed
OF_THE_RESIDUAL = 0.5  # an effect smaller than this share of what stays unexplained may be part of that


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
    """One effect tried on top of those already chosen; ``why_not``: why it may not be added, None: it may.

    ``beside``: why it may only be added where others come to explain the rest, None: it may at once.
    """

    effect: Effect
    fit: Fit
    evidence: Evidence
    q_value: float = 1.0
    weight: float = 0.0
    why_not: Statement | None = None
    beside: Statement | None = None


def tried(
    current: Fit,
    effects: Sequence[Effect],
    prior: Noise,
    gates: Gates,
    least: float,
    *,
    behind: float = HOPELESS,
) -> list[Trial]:
    """Fit each effect jointly with what is there, compare, and apply the gates.

    Effects that are further ``behind`` the foremost one in log-likelihood are not followed to their end, and
    no condition is left out for them: they are tried again once that one is added. Where none of the others
    passes the gates, they are followed after all. What is not of the library is tried where nothing of it may
    be added at once: a cause of the library goes before it, and the contest weighs it in its place.
    """
    library = [effect for effect in effects if not effect.resembled]
    trials = _judged(current, library, prior, gates, least, behind=behind)
    if len(library) == len(effects) or any(not (trial.why_not or trial.beside) for trial in trials):
        return trials
    return _judged(current, effects, prior, gates, least, behind=behind)


def _judged(
    current: Fit, effects: Sequence[Effect], prior: Noise, gates: Gates, least: float, *, behind: float
) -> list[Trial]:
    """Try effects against one another, as :func:`tried` says."""
    made, given_up = _made(current, effects, prior, gates, least, behind=behind)
    trials = _gated(made, gates, least)
    far = _far_behind(trials, given_up, behind)
    judged = _held_out(current, [far.get(trial.effect.key, trial) for trial in trials], prior, gates)
    if not far or not all(trial.why_not for trial in judged):
        return judged
    if given_up:
        made, _ = _made(current, effects, prior, gates, least, behind=np.inf)
    return _held_out(current, _gated(made, gates, least), prior, gates)


def _made(
    current: Fit, effects: Sequence[Effect], prior: Noise, gates: Gates, least: float, *, behind: float
) -> tuple[list[Trial], set[tuple[str, str]]]:
    """Fit the effects, the most promising one first; return trials before any gate, and which were given up.

    An effect is given up where it stays too far behind the foremost one that may be added at once.
    """
    trials: dict[Effect, Trial] = {}
    given_up: set[tuple[str, str]] = set()
    bound, foremost = np.inf, -np.inf
    for effect in sorted(effects, key=lambda each: _promised(current, each)):
        candidate = Candidate(current.candidate.base, (*current.candidate.effects, effect))
        larger, stopped = raced(candidate, current, prior, Race(bound, foremost - behind))
        given_up |= {effect.key} if stopped else set()
        trials[effect] = Trial(effect, larger, compare(current, larger))
        cautious = replace(trials[effect], q_value=len(effects) * trials[effect].evidence.p_value)
        if not _refused(cautious, gates, least) and not small_beside_residual(cautious.evidence):
            bound = min(bound, cost_under(larger, current.noise) + 2.0 * behind)
            foremost = max(foremost, larger.total)
    return [trials[effect] for effect in effects], given_up


def _promised(current: Fit, effect: Effect) -> float:
    """Return the cost that one step from an effect's first start promises."""
    candidate = Candidate(current.candidate.base, (*current.candidate.effects, effect))
    theta = np.concatenate([current.theta, [one.starts[0] for one in effect.parameters]])
    state = State(theta, current.beta, {})
    search_nuisance(candidate, current.blocks, current.noise, state, current.nuisance)
    own = State(current.theta, current.beta, dict(current.nuisance))
    slopes = effect_slopes(current.candidate, current.blocks, own)
    system = linearised(candidate, current.blocks, current.noise, state, slopes=slopes)
    return system.cost - ahead(*normal_equations(system))


def _gated(trials: Sequence[Trial], gates: Gates, least: float) -> list[Trial]:
    """Apply the gates that need no condition left out."""
    q_values = residual.q_values([trial.evidence.p_value for trial in trials])
    known = [replace(trial, q_value=float(q)) for trial, q in zip(trials, q_values, strict=True)]
    return [
        replace(
            trial,
            why_not=_refused(trial, gates, least),
            beside=small_beside_residual(trial.evidence),
        )
        for trial in known
    ]


def _refused(trial: Trial, gates: Gates, least: float) -> Statement | None:
    """Return why an effect may not be added, by its fit on all runs; None: it may.

    That nothing is predicted comes first, then that it gains no more than chance: a fit that gains nothing is
    not followed to its end.
    """
    if nothing := beyond(trial.fit, trial.fit.blocks):
        return nothing
    by_evidence = _why_not(trial.evidence, trial.q_value, gates, least)
    if by_evidence and trial.evidence.statistic < len(trial.effect.parameters):
        return by_evidence
    return (
        unsettled(trial.fit, trial.effect)
        or by_evidence
        or (Statement("unlike") if unlike(trial.effect, trial.fit) else None)
    )


def _far_behind(
    trials: Sequence[Trial], given_up: set[tuple[str, str]], behind: float
) -> dict[tuple[str, str], Trial]:
    """Return the trials that are too far behind the foremost one that may be added, saying so of each.

    The foremost is one that may be added at once, where there is any. ``given_up``: those of which that was
    seen before they were followed to their end.
    """
    open_to = [trial for trial in trials if not trial.why_not and trial.effect.key not in given_up]
    foremost = max(
        (trial.fit.total for trial in open_to if not trial.beside),
        default=max((trial.fit.total for trial in open_to), default=-np.inf),
    )
    last = given_up | {trial.effect.key for trial in open_to if trial.fit.total < foremost - behind}
    return {
        trial.effect.key: replace(
            trial, why_not=Statement("far_behind", {"behind": foremost - trial.fit.total})
        )
        for trial in trials
        if trial.effect.key in last
    }


def _held_out(current: Fit, trials: list[Trial], prior: Noise, gates: Gates) -> list[Trial]:
    """Apply the held-out gate, and weigh the candidates against each other and against adding nothing."""
    if all(trial.why_not for trial in trials):
        return trials
    out = leave_out(current, prior)
    trials = [
        trial if trial.why_not else replace(trial, evidence=hold_out(trial.evidence, out, trial.fit, prior))
        for trial in trials
    ]
    trials = [replace(trial, why_not=trial.why_not or beyond_left_out(trial.fit, prior)) for trial in trials]
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


def _why_not(evidence: Evidence, q: float, gates: Gates, least: float) -> Statement | None:
    if q > gates.false_additions:
        by_chance = q if evidence.p_value <= gates.false_additions else None
        return Statement("no_evidence", {"p_value": evidence.p_value, "q_value": by_chance})
    return immaterial(evidence, least)


def immaterial(evidence: Evidence, least: float) -> Statement | None:
    """Return that an effect is smaller than what matters, or than errors of the inputs may be, if it is."""
    if evidence.size < least:
        return Statement("immaterial", {"size": evidence.size, "least": least})
    return None


def small_beside_residual(evidence: Evidence) -> Statement | None:
    """Return that an effect is small beside what stays unexplained with it, if it is."""
    if evidence.size < OF_THE_RESIDUAL * evidence.missed:
        return Statement("small_beside_residual", {"size": evidence.size, "missed": evidence.missed})
    return None


def _not_held_out(evidence: Evidence, gates: Gates) -> Statement | None:
    if evidence.gain < gates.held_out_gain:
        return Statement("no_gain", {"gain": evidence.gain, "needed": gates.held_out_gain})
    if evidence.better_share < LEAST_BETTER:
        return Statement("better_in_few", {"share": evidence.better_share})
    return None


def unlike(effect: Effect, fitted: Fit) -> bool:
    """Whether an effect that is not of the library leaves a significant residual: no likeness then.

    Where much stays unexplained, what has more freedom comes nearer to it, whatever the cause.
    """
    budget = fitted.noise.budget
    if not effect.resembled or missed(fitted) <= budget:
        return False
    return bool(residual.share_left(residual.signature(fitted, budget)))


def without(base: Fit, kept: tuple[Effect, ...], prior: Noise) -> Fit:
    """Refit with the effects that are kept, one after another on top of the ``base`` fit, slow ones last."""
    fitted = base
    for effect in sorted(kept, key=lambda effect: effect.slow):
        candidate = Candidate(base.candidate.base, (*fitted.candidate.effects, effect))
        fitted = fit(candidate, base.blocks, prior, fitted)
    return fitted


def parted(base: Fit, current: Fit, effect: Effect, prior: Noise) -> tuple[Fit, Fit]:
    """Return the fit without one of its effects, and the fit with it.

    A model is at least as likely as one that it contains. Where it is not, its noise was estimated from a
    start that leads astray: it is fitted again from where the smaller one ended.
    """
    smaller = without(base, tuple(one for one in current.candidate.effects if one is not effect), prior)
    if smaller.total > current.total:
        whole = Candidate(base.candidate.base, (*smaller.candidate.effects, effect))
        again = fit(whole, base.blocks, prior, smaller)
        current = again if again.total > current.total else current
    return smaller, current
