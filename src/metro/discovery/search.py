"""The search for a term: all are screened by one linear step, the foremost fitted and put to the gates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from metro.discovery.entry import Entry
from metro.discovery.facts import facts_of
from metro.discovery.grammar import Setting, grammar
from metro.discovery.screen import Screened, foremost, screened
from metro.effects.effect import Effect, fitted_to
from metro.effects.library import library
from metro.loop.ceiling import aligned, ceiling
from metro.loop.checks.left_out import unseen
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Fit, fit
from metro.loop.fitting.noise import Noise, first_noise
from metro.loop.search.trial import Gates, Trial, tried
from metro.observables.problem import Problem
from metro.units import JSON

FITTED, ALIKE = 6, 2  # terms that are fitted; of these, that differ by their form alone
HALF = 0.5  # of what any cause could explain, that a proposal explains at least
LEAST_SHARE = 0.05  # of the residual, that is explainable at least
EVEN = 1e-6  # rad by which the pitch of teeth differs where they are not alike


@dataclass(frozen=True, eq=False)
class Tried:
    """A term that was fitted: its trial, and the share of the residual of left-out conditions it explains."""

    entry: Entry
    trial: Trial
    share: float

    @property
    def passed(self) -> bool:
        """Whether it passed every gate of the loop."""
        return self.trial.why_not is None


@dataclass(frozen=True, eq=False)
class Search:
    """What a search found.

    Attributes
    ----------
    current : the fit with all effects that the verdict names. prior : the noise before anything was known.
    count : of the terms that the batch admits. terms : those that were fitted, the best first.
    ceiling : what any cause could explain (:func:`metro.loop.ceiling.ceiling`); None where that is not known.
    explainable : share of the residual that could be explained.
    """

    current: Fit
    prior: Noise
    count: int
    terms: tuple[Tried, ...]
    ceiling: JSON | None
    explainable: float

    @property
    def proposal(self) -> Tried | None:
        """The best term that passed every gate and explains enough; None: nothing is proposed."""
        enough = HALF * self.explainable
        return next((one for one in self.terms if one.passed and one.share >= enough), None)


def searched(problem: Problem, base: Fit, found: list[JSON], gates: Gates) -> Search:
    """Search the grammar for a term that a problem's model lacks, on identification runs alone.

    ``base``: the fit of the base model. ``found``: the effects of the verdict, which the model has already.
    """
    prior = first_noise(gates.model_form_budget, problem.scatter, base.blocks)
    current = with_found(problem, base, found, prior)
    entries = admitted(problem, current)
    looked = screened(current, entries, aligned(problem, current))
    first = foremost(looked, FITTED, ALIKE)
    least = max(gates.materiality, 2.0 * problem.systematic)
    effects = {one.entry.name: one for one in _one_of_a_name(first)}
    trials = tried(
        current,
        [one.entry.effect(one.sizes, float(len(entries))) for one in effects.values()],
        prior,
        gates,
        least,
        behind=np.inf,
    )
    fitted = [
        Tried(effects[trial.effect.name].entry, trial, _share(current, trial, prior)) for trial in trials
    ]
    known = ceiling(problem, current)
    ordered = sorted(fitted, key=lambda one: (not one.passed, -_gain(one.trial)))
    return Search(current, prior, len(entries), tuple(ordered), known, _explainable(known))


def tried_term(search: Search, entry: Entry) -> Fit:
    """Fit one term on top of what the model has, from the step by which it is screened."""
    (one,) = screened(search.current, [entry], search.current.nuisance)
    effects = (*search.current.candidate.effects, entry.effect(one.sizes, 1.0))
    candidate = Candidate(search.current.candidate.base, effects)
    return fit(candidate, search.current.blocks, search.prior, search.current)


def with_found(problem: Problem, base: Fit, found: list[JSON], prior: Noise) -> Fit:
    """Return the fit with the effects of a verdict, begun where the verdict has them."""
    able, _ = fitted_to(library(problem.observable), problem)
    effects = [effect for one in found for effect in [_at(able, one)] if effect is not None]
    if not effects:
        return base
    return fit(Candidate(problem.base, tuple(effects)), base.blocks, prior, base)


def admitted(problem: Problem, current: Fit) -> list[Entry]:
    """Return the terms of the grammar that a batch admits."""
    blocks = problem.role("identify")
    model: Any = current.candidate.model(current.theta)
    cutter = model.cutter
    alike = not (cutter.runout_radius or any(cutter.reach)) and float(np.ptp(cutter.pitch(1))) < EVEN
    readings = {
        axis: float(
            np.median(
                [
                    np.abs(block.to_rows(block.measured)[block.coordinates["axis"] == axis]).max()
                    for block in blocks
                ]
            )
        )
        for axis in "xyz"
    }
    return grammar(Setting(facts_of(model, blocks), cutter.teeth, alike, readings))


def _one_of_a_name(found: list[Screened]) -> list[Screened]:
    """Return the best of those that differ by the start of a length alone."""
    best: dict[str, Screened] = {}
    for one in found:
        best.setdefault(one.entry.name, one)
    return list(best.values())


def _at(able: tuple[Effect, ...], said: Mapping[str, Any]) -> Effect | None:
    """Return an effect that starts from the values of a verdict."""
    values = {name: one for name, one in said["parameters"].items() if not isinstance(one, int | str)}
    for effect in able:
        where = {name: said["parameters"].get(name) for name in effect.where}
        if effect.name != said["effect"] or set(effect.names) != set(values) or where != dict(effect.where):
            continue
        left = {name: iter(one if isinstance(one, list) else [one]) for name, one in values.items()}
        reported = np.array([next(left[parameter.name])["value"] for parameter in effect.reported])
        theta = np.linalg.lstsq(effect.matrix, reported, rcond=None)[0].tolist()
        return replace(
            effect,
            parameters=tuple(
                replace(parameter, starts=(min(max(value, parameter.lower), parameter.upper),), group=0)
                for parameter, value in zip(effect.parameters, theta, strict=True)
            ),
        )
    return None


def _share(current: Fit, trial: Trial, prior: Noise) -> float:
    """Share of the residual's power on left-out conditions that a term explains; 0 if none were left out."""
    if not trial.evidence.held_out:
        return 0.0
    before, after = (_power(unseen(fitted, prior)) for fitted in (current, trial.fit))
    return 1.0 - after / before if before > 0.0 else 0.0


def _power(scored: tuple[Fit, ...]) -> float:
    return sum(
        float(np.sum((block.measured - fitted.predict(block)) ** 2)) / block.repeats
        for fitted in scored
        for block in fitted.blocks
    )


def _gain(trial: Trial) -> float:
    """Order trials: by the gain on left-out conditions, before that by the evidence on the fitted runs."""
    return trial.evidence.gain if trial.evidence.held_out else -1e9 + trial.evidence.statistic


def _explainable(known: JSON | None) -> float:
    """Share of the residual that could be explained; all that is no noise where the ceiling may be chance."""
    if known is None:
        return 1.0
    beyond = max(LEAST_SHARE, 1.0 - float(known["noise_share"]))
    return float(known["share"]) if known["ci95"][0] > 0.0 else beyond
