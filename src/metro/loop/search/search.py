"""The search: which effects, if any, the residual of an observable is traced to.

A strategy chooses among the effects that these runs can show; then the outcome is described: what the
residual looks like, and what these runs cannot show. The validation runs are not read here.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from metro.effects.effect import Effect, fitted_to
from metro.loop.checks import signature as residual
from metro.loop.checks.between import Between, between_conditions
from metro.loop.checks.evidence import dimmed, seen_from, surviving_share
from metro.loop.checks.restless import Restless, restless
from metro.loop.checks.session import Step, scan
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Fit, fit
from metro.loop.fitting.noise import Noise, first_noise
from metro.loop.search.forward import forward
from metro.loop.search.outcome import Outcome, withdrawn
from metro.loop.search.strategy import Choice, SearchSpace, Strategy
from metro.loop.search.trial import Gates, Trial, without
from metro.loop.statement import Statement
from metro.observables.problem import Problem

STRATEGY: Strategy = forward  # the one in use
# Share of a signature that the base parameters leave, below which it is not tried unless one of typical size
# would be seen in that.
NOT_VISIBLE = 0.02
STRAINED = 0.01  # p-value of what is believed beforehand in the base fit, below which all are tried
DIM = 0.1  # share that the zeros of the runs leave, below which an effect is listed as hidden by them
EVEN = 0.5  # probability that one of the effects, or a rival of it, must exceed for any to be claimed
SESSION = 0.005  # p-value of a step along the session that counts
SESSION_SIZE = 0.01  # and its least size, relative to the parameter
CONDITIONS = 0.001  # p-value of differences between conditions that count
RUNS = 0.001  # p-value of a scatter between runs that counts


def search(
    problem: Problem,
    library: Sequence[Effect],
    gates: Gates,
    strategy: Strategy = STRATEGY,
    base: Fit | None = None,
) -> Outcome:
    """Search the library for the effects that a problem's base model lacks, on identification runs alone.

    ``base``: the fit of the base model, where it is known already.
    """
    effects, unable = fitted_to(tuple(library), problem)
    blocks = problem.role("identify", "calibrate")
    prior = first_noise(gates.model_form_budget, problem.scatter, blocks)
    base = base or fit(Candidate(problem.base), blocks, prior)
    visible, absorbed = _visible(effects, base)
    space = SearchSpace(base, visible, prior, gates, problem.least_residual(gates.materiality))
    floor = problem.least_residual(max(gates.materiality, gates.model_form_budget))
    return _described(space, strategy(space), tuple(library), unable | absorbed, floor)


def _visible(effects: Sequence[Effect], base: Fit) -> tuple[tuple[Effect, ...], dict[str, Statement]]:
    """Return the effects whose signature the base parameters do not absorb, and why the others are hidden.

    Those of which they leave little are hidden, unless one of typical size would be seen all the same: a
    corner of a tool looks much like other coefficients, but not quite, and the rest is far above the noise.

    Where base parameters are strained far from what is believed of them, an effect that they absorb may be
    why: a force that is known to 4 % replaces a tip that is softer by a quarter. Then all are tried.
    """
    if _strained(base):
        return tuple(effects), {}
    shares = {
        effect.key: surviving_share(Candidate(base.candidate.base, (effect,)), base)
        for effect in effects
        if not effect.resembled
    }
    visible = tuple(
        effect
        for effect in effects
        if shares.get(effect.key, 1.0) >= NOT_VISIBLE
        or seen_from(Candidate(base.candidate.base, (effect,)), base) < effect.typical
    )
    names = {effect.name for effect in visible}
    absorbed = {
        name: Statement("absorbed", {"share": share})
        for (name, _), share in shares.items()
        if name not in names
    }
    return visible, absorbed


def _strained(base: Fit) -> bool:
    from scipy.stats import norm

    deviations = [
        np.abs(block.measured - base.predict(block)) / block.sigma for block in base.blocks if block.belief
    ]
    return any(2.0 * len(far) * float(norm.sf(far.max())) < STRAINED for far in deviations if len(far))


def _described(
    space: SearchSpace,
    choice: Choice,
    library: tuple[Effect, ...],
    not_visible: dict[str, Statement | str],
    floor: float,
) -> Outcome:
    """Describe what a strategy chose: the fits without what is not of the library, and the residual.

    ``floor``: the least residual that counts, relative to the signal.
    """
    base, prior, likeness = space.base, space.prior, choice.fit
    final = _of_the_library(base, likeness, prior)
    outcome = Outcome(
        base=base,
        final=final,
        steps=_steps(base, choice.steps, final),
        trials=_foremost(choice.trials, final),
        weight=choice.weight,
        rivals=choice.rivals,
        base_lines=tuple(residual.signature(base, floor)),
        lines=tuple(residual.signature(final, floor)),
        seen=space.effects,
        prior=prior,
        step=_stepping(likeness, space.gates.seed),
        base_between=_differing(base, floor),
        between=_differing(likeness, floor),
        base_restless=_unsteady(base, prior, floor),
        restless=_unsteady(likeness, prior, floor),
        offered=library,
        not_visible=not_visible,
        dim=_dim(base, space.effects),
        likeness=likeness if likeness is not final else None,
    )
    likeliest = max(map(outcome.some, outcome.names), default=outcome.explained)
    return outcome if likeliest > EVEN else withdrawn(outcome, Statement("unbelieved"))


def _of_the_library(base: Fit, fitted: Fit, prior: Noise) -> Fit:
    """Refit without the effects that are not of the library; the same fit where there are none."""
    kept = tuple(effect for effect in fitted.candidate.effects if not effect.resembled)
    return fitted if len(kept) == len(fitted.candidate.effects) else without(base, kept, prior)


def _steps(base: Fit, steps: Sequence[Fit], final: Fit) -> tuple[Fit, ...]:
    """Return the fits on the way to the final one, which is the last unless it is the base fit."""
    own = [fitted for fitted in steps if not any(effect.resembled for effect in fitted.candidate.effects)]
    return tuple(own if final in (base, *own) else [*own, final])


def _dim(base: Fit, effects: Iterable[Effect]) -> dict[str, Statement]:
    """Return of which effects the zeros of the runs leave little, and from which size they show.

    Those sought among many places are left out: their first parameter is a place, no size.
    """
    dim: dict[str, Statement] = {}
    for effect in effects:
        if effect.resembled or effect.sought > 1.0:
            continue
        left = dimmed(Candidate(base.candidate.base, (effect,)), base)
        if left.share < DIM:
            size = {"least": left.least, "unit": effect.parameters[0].unit}
            dim[effect.name] = Statement("hidden_by_zeros", {"share": left.share, **size})
    return dim


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


def _stepping(fitted: Fit, seed: int) -> Step | None:
    """Return the step along the session, where that counts."""
    step = scan(fitted, seed)
    return step if step and step.p_value < SESSION and abs(step.relative) > SESSION_SIZE else None


def _differing(fitted: Fit, least: float) -> Between | None:
    """Return how the conditions differ, where that counts."""
    differing = between_conditions(fitted)
    return differing if differing and differing.p_value < CONDITIONS and differing.relative > least else None


def _unsteady(fitted: Fit, prior: Noise, least: float) -> Restless | None:
    """Return how the runs scatter, where that is beyond the usual and counts."""
    scatter = restless(fitted, prior)
    return scatter if scatter and scatter.p_value < RUNS and scatter.relative > least else None
