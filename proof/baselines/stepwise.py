"""Plain forward selection: the effect of the library that lowers the BIC most is added, until none does.

The probability of an effect is its weight among the models of its round, exp(−BIC/2) (Raftery, Sociol.
Methodol. 25 (1995) 111). Every sample counts as evidence of its own, nothing is left out and predicted, and
what is left over is not looked at.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
import pandas as pd

from metro.effects.effect import Effect, fitted_to
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Fit, fit
from metro.loop.fitting.noise import first_noise
from metro.loop.labels.hypotheses import Hypothesis, LabelEvidence, hypothesis
from metro.loop.labels.problem import tests_of
from metro.loop.labels.search import predicted
from metro.loop.verdict.verdict import parameters
from metro.observables.labelled import Labelled
from metro.observables.problem import Problem, Refusal
from metro.units import JSON, Array
from proof.baselines.program import TOO_FEW, Given, held_out_rows, said
from proof.label_oracle import usual_errors

MOST = 4  # effects
Model = TypeVar("Model")


@dataclass(frozen=True)
class Chosen(Generic[Model]):
    """The last model, the probability of each effect chosen, and of those that were not."""

    model: Model
    named: dict[str, float]
    candidates: dict[str, float]


def forward(
    base: Model,
    effects: Sequence[Effect],
    added: Callable[[Model, Effect], Model],
    bic: Callable[[Model], float],
) -> Chosen[Model]:
    """Add effects while the BIC falls.

    Parameters
    ----------
    added : the model with one more effect, fitted. bic : of a fitted model.
    """
    model = base
    named: dict[str, float] = {}
    candidates: dict[str, float] = {}
    while len(named) < MOST:
        left = [effect for effect in effects if effect.name not in named]
        models = [model, *(added(model, effect) for effect in left)]
        shares = weights([bic(one) for one in models])
        candidates = {}
        for effect, share in zip(left, shares[1:], strict=True):  # of several forms the likeliest
            candidates[effect.name] = max(share, candidates.get(effect.name, 0.0))
        best = int(np.argmax(shares))
        if best == 0:
            break
        named[left[best - 1].name] = shares[best]
        model = models[best]
    return Chosen(model, named, {name: p for name, p in candidates.items() if name not in named})


def weights(bic: Sequence[float]) -> list[float]:
    """Return the weight of each model among all."""
    weight = np.exp(-0.5 * (np.array(bic) - min(bic)))
    shares: list[float] = (weight / weight.sum()).tolist()
    return shares


@dataclass(frozen=True)
class Stepwise:
    """Handler: the answer by plain stepwise selection."""

    given: Given

    def sampled(self, problem: Problem) -> JSON:
        """Select among the effects that the residual may show."""
        base = self.given.base
        if base is None:
            return TOO_FEW
        blocks = problem.role("identify", "calibrate")
        prior = first_noise(self.given.budget, problem.scatter, blocks)

        def added(model: Fit, effect: Effect) -> Fit:
            larger = Candidate(problem.base, (*model.candidate.effects, effect))
            return fit(larger, blocks, prior, model)

        chosen = forward(base, self._able(problem), added, bic_of_fit)
        rows = held_out_rows(problem, base, chosen.model)
        return _answer(chosen, rows, lambda name: parameters(chosen.model, name))

    def labelled(self, problem: Labelled) -> JSON:
        """Select among the effects of the boundary."""
        tests, _ = tests_of(problem, "identify")
        held, runs = tests_of(problem, "validate")
        if not len(tests.depth):
            return TOO_FEW
        errors = usual_errors(problem, self.given.seed)
        evidence = LabelEvidence(problem.boundaries, problem.estimates, tests, errors, self.given.seed)

        def added(model: Hypothesis, effect: Effect) -> Hypothesis:
            return hypothesis((*model.effects, effect), evidence, model if model.effects else None)

        nothing = hypothesis((), evidence)
        chosen = forward(
            nothing, self._able(problem), added, lambda model: bic_of_labels(model, len(tests.depth))
        )
        rows = problem.comparison()
        if chosen.named and len(held.depth):
            corrected = pd.Series(predicted(chosen.model, held, errors), index=list(runs))
            after = corrected.reindex(rows["run"]).to_numpy()
            rows = rows.assign(after=np.where(np.isfinite(after), after, rows["before"]))
        return _answer(chosen, rows, chosen.model.parameters)

    def refused(self, _refusal: Refusal) -> JSON:
        """Say that there is nothing to tell from."""
        return TOO_FEW

    def _able(self, problem: Problem | Labelled) -> list[Effect]:
        able, _ = fitted_to(self.given.effects, problem)
        return [effect for effect in able if not effect.resembled]


def bic_of_fit(fitted: Fit) -> float:
    """BIC of a fit: its free parameters are those of its effects; those of the base all fits share."""
    runs = sum(block.role != "calibrate" for block in fitted.blocks)
    own = runs * sum(effect.own for effect in fitted.candidate.effects)
    return (len(fitted.theta) + own) * math.log(sum(fitted.elements.values())) - 2.0 * fitted.total


def bic_of_labels(model: Hypothesis, tests: int) -> float:
    """BIC of a hypothesis on labels at the best of the parameters that were tried."""
    from scipy.special import logsumexp

    total: Array = model.likelihood.sum(axis=2)
    best = float(np.max(logsumexp(total, axis=1))) - math.log(total.shape[1])
    return float(model.theta.shape[1] * math.log(tests) - 2.0 * best)


def _answer(chosen: Chosen[Model], rows: pd.DataFrame, found: Callable[[str], JSON]) -> JSON:
    effects = [
        {"effect": name, "probability": p, "parameters": found(name)} for name, p in chosen.named.items()
    ]
    candidates = [{"effect": name, "probability": p} for name, p in chosen.candidates.items()]
    return said("explained" if effects else "clean", rows, effects=effects, candidates=candidates)
