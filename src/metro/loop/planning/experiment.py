"""What to measure next: the feasible runs that would distinguish two explanations, or show a hidden effect.

Before a run is made, each of two fitted models says what it would measure, and how sure it is of that. If one
of them is true, the logarithm of the Bayes factor in its favour has a mean and a variance that follow from
these predictions (for models with parameters known exactly, d²/2 and d², with d the distance of the
predictions in units of the noise: Box & Hill 1967, Technometrics 9). The probability that it gets above three
(odds of twenty) is the probability of deciding.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from metro.effects.effect import Effect, fitted_to
from metro.loop.checks.evidence import sensitivity, unabsorbed_share
from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Fit, score
from metro.loop.fitting.system import moved_models, sensitivities
from metro.loop.search.search import NOT_VISIBLE
from metro.observables.problem import Block, Problem, Proposal
from metro.units import Array

DECIDED = 3.0  # log Bayes factor
ENOUGH = 0.95  # probability of deciding with which an experiment is worth its while
MOST_REPEATS = 6
TWICE = 2  # times that runs to show a hidden effect are made


@dataclass(frozen=True)
class Prospect:
    """What a proposal promises for a pair of explanations.

    ``probability`` of deciding between them when its runs are made ``repeats`` times, the least number that
    brings it to ``ENOUGH`` or the largest tried; ``once`` that of making them once.
    """

    proposal: Proposal
    repeats: int
    probability: float
    once: float

    @property
    def decides(self) -> bool:
        """Whether it is likely to decide."""
        return self.probability >= ENOUGH

    @property
    def runs(self) -> int:
        """Number of runs to be made."""
        return self.repeats * len(self.proposal.blocks)


@dataclass(frozen=True)
class _Forecast:
    """One run as two models see it: the truth's prediction less the other's, and what may move either.

    ``mine``, ``others`` (n, k): derivatives by the parameters of the truth and of the other model, ``own``
    by the run's unknowns in both; ``shared``: directions in which the run as a whole may be off.
    """

    block: Block
    difference: Array
    mine: Array
    others: Array
    own: Array
    shared: Array


@lru_cache(maxsize=64)
def prospects(one: Fit, other: Fit, proposals: tuple[Proposal, ...]) -> tuple[Prospect, ...]:
    """Return what each proposal promises for distinguishing two fits, the best first.

    Parameters
    ----------
    one, other : fits of the same blocks; either may be the truth, with even odds.
    """
    promised = [_prospect(one, other, proposal) for proposal in proposals]
    return tuple(sorted(promised, key=_merit))


def _merit(prospect: Prospect) -> tuple[float, ...]:
    """Fewest runs first among those that decide, then the most probable."""
    runs = prospect.runs if prospect.decides else math.inf
    return runs, -prospect.probability, -prospect.once


def _prospect(one: Fit, other: Fit, proposal: Proposal) -> Prospect:
    chance = [
        sum(0.5 * deciding(*forecast) for forecast in either)
        for either in zip(*expected(one, other, proposal), strict=True)
    ]
    enough = next((i for i, value in enumerate(chance) if value >= ENOUGH), MOST_REPEATS - 1)
    return Prospect(proposal, enough + 1, chance[enough], chance[0])


@lru_cache(maxsize=1024)
def expected(one: Fit, other: Fit, proposal: Proposal) -> tuple[list[tuple[float, float]], ...]:
    """Mean and deviation of the log Bayes factor for the truth, be it ``one`` or ``other``: two lists.

    Each by the repeats of the proposal's runs, from one to ``MOST_REPEATS``.
    """
    return tuple(
        [log_bayes_factor(a, b, forecasts, repeats) for repeats in range(1, MOST_REPEATS + 1)]
        for a, b in ((one, other), (other, one))
        for forecasts in [_forecasts(a, b, proposal.blocks)]
    )


def probability(truth: Fit, other: Fit, blocks: Sequence[Block], repeats: int = 1) -> float:
    """Probability that runs decide for ``truth`` if it is true, each made ``repeats`` times."""
    return deciding(*log_bayes_factor(truth, other, _forecasts(truth, other, blocks), repeats))


def deciding(mean: float, deviation: float) -> float:
    """Probability that a log Bayes factor of this mean and standard deviation exceeds ``DECIDED``."""
    from scipy.stats import norm

    return float(norm.cdf((mean - DECIDED) / max(deviation, 1e-9)))


def log_bayes_factor(
    truth: Fit, other: Fit, forecasts: Sequence[_Forecast], repeats: int
) -> tuple[float, float]:
    """Mean and standard deviation of the log Bayes factor for ``truth`` if it is true.

    Both models are linear about their fits with normal parameters (the covariance of each fit), so the new
    measurements are normal under each: N(0, S) under the truth and N(−r, T) under the other one. Everything
    beyond the space of r and of the derivatives is noise to both and is left out. The mean is the
    Kullback–Leibler divergence, the variance that of a quadratic form.
    """
    rows = _rows(truth, forecasts, repeats)
    square = np.asarray(np.linalg.qr(rows, mode="r"), dtype=float)
    p = truth.covariance.shape[0]
    difference, mine, others = square[:, 0], square[:, 1 : 1 + p], square[:, 1 + p :]
    unit = np.eye(len(square))
    under_truth = unit + mine @ covariance(truth) @ mine.T
    under_other = unit + others @ covariance(other) @ others.T
    precision = np.linalg.inv(under_other)
    ratio = precision @ under_truth
    pull = precision @ difference
    mean = 0.5 * (np.trace(ratio) - len(unit) - np.linalg.slogdet(ratio)[1] + difference @ pull)
    variance = 0.5 * np.trace((ratio - unit) @ (ratio - unit)) + pull @ under_truth @ pull
    return float(mean), math.sqrt(max(0.0, float(variance)))


def _rows(truth: Fit, forecasts: Sequence[_Forecast], repeats: int) -> Array:
    """Forecasts of runs, each made ``repeats`` times, in units of the noise: (n, 1 + k + l)."""
    made = Counter(forecast.block.condition for forecast in forecasts for _ in range(repeats))
    known = truth.noise.repeats
    cut = {name: known.get(name, 0) + count for name, count in made.items()}
    noise = replace(truth.noise, repeats={**known, **cut})
    return np.vstack([_whitened(forecast, noise) for forecast in forecasts]) * math.sqrt(repeats)


def information(fitted: Fit, proposal: Proposal, repeats: int) -> Array:
    """Information (k, k) that a proposal's runs would add on the base and effect parameters of a fit."""
    rows = _rows(fitted, _forecasts(fitted, fitted, proposal.blocks), repeats)
    mine = rows[:, 1 : 1 + len(fitted.covariance)]
    return np.asarray(mine.T @ mine)


def covariance(fitted: Fit) -> Array:
    """Covariance of a fit's parameters; one of which nothing is known may be anywhere within its bounds."""
    reach = np.array([(p.upper - p.lower) / math.sqrt(12.0) for p in fitted.candidate.parameters])
    widest = np.concatenate([fitted.beta, reach]) ** 2
    known = fitted.covariance * fitted.dispersion
    unknown = ~np.isfinite(np.diag(known))
    known[unknown, :] = known[:, unknown] = 0.0
    known[unknown, unknown] = widest[unknown]
    return np.asarray(known)


def _whitened(forecast: _Forecast, noise: noise_room.Noise) -> Array:
    """Difference and derivatives (n, 1 + k + l) in units of the noise; own unknowns take what they can."""
    whiten = noise_room.whitener(noise_room.diagonal(forecast.block, noise), forecast.shared)
    columns = whiten(np.column_stack([forecast.difference, forecast.mine, forecast.others]))
    own = whiten(forecast.own)
    taken = own @ np.linalg.lstsq(own, columns, rcond=None)[0] if own.shape[1] else 0.0
    return np.asarray(columns - taken)


def _forecasts(truth: Fit, other: Fit, blocks: Sequence[Block]) -> list[_Forecast]:
    """Predict runs by two fits, the other one's unknowns where they fit the truth's prediction best."""
    made, starts = as_cut(truth, blocks)
    imitated = score(other, made).nuisance
    return [_forecast(truth, starts[block.run], other, imitated[block.run], block) for block in made]


def _forecast(truth: Fit, at: Array, other: Fit, imitated: Array, block: Block) -> _Forecast:
    predicted, mine, own = _derivatives(truth, block, at)
    alike, others, theirs = _derivatives(other, block, imitated)
    shared = noise_room.shared(block, truth.noise, mine[:, : len(truth.beta)], truth.beta)
    return _Forecast(block, predicted - alike, mine, others, np.hstack([own, theirs]), shared)


def _derivatives(fitted: Fit, block: Block, nuisance: Array) -> tuple[Array, Array, Array]:
    """Prediction of a fit (n,), its derivatives by base and effect parameters, and by the run's unknowns."""
    model = fitted.candidate.model(fitted.theta)
    matrix, offset = model.design(block, nuisance, fitted.beta)
    predicted = offset + matrix @ fitted.beta
    moved = moved_models(fitted.candidate, fitted.theta)
    effect, own = sensitivities(model, moved, block, nuisance, fitted.beta)
    return predicted, np.hstack([matrix, effect]), own


def as_cut(truth: Fit, blocks: Sequence[Block]) -> tuple[list[Block], dict[str, Array]]:
    """Return blocks as a fit predicts them, with the run's unknowns at their first starts, by run."""
    model = truth.candidate.model(truth.theta)
    made, starts = [], {}
    for block in blocks:
        starts[block.run] = np.asarray(model.nuisance_starts(block)[0], dtype=float)
        matrix, offset = model.design(block, starts[block.run], truth.beta)
        predicted = offset + matrix @ truth.beta
        scale = None if block.scale is None else block.scale * _growth(block, predicted)
        made.append(replace(block, measured=predicted, scale=scale))
    return made, starts


def _growth(block: Block, predicted: Array) -> Array:
    """Rms of each element's axis as predicted over that of the run that the block is like, (n,)."""
    growth = np.ones(len(predicted))
    for axis in np.unique(block.axis):
        chosen = block.axis == axis
        before = float(np.sum(block.measured[chosen] ** 2))
        growth[chosen] = math.sqrt(float(np.sum(predicted[chosen] ** 2)) / before) if before else 1.0
    return growth


@dataclass(frozen=True)
class View:
    """A proposal that would show a hidden effect, with the share of the signature that would be left.

    ``chance``: the probability that the effect is seen if it has its typical size, the proposal's runs made
    twice.
    """

    effect: str
    proposal: Proposal
    share: float
    chance: float


def best_view(problem: Problem, base: Fit, effects: Sequence[Effect]) -> View | None:
    """Return the proposal that leaves most of the signature of an effect, if it is visible with it.

    Parameters
    ----------
    effects : the forms of one effect, as they are in the library.
    """
    views = [
        View(effects[0].name, proposal, *_share(problem, base, effects, proposal))
        for proposal in problem.feasible
    ]
    best = max(views, key=lambda view: view.share, default=None)
    return best if best and best.share >= NOT_VISIBLE else None


def _share(problem: Problem, base: Fit, effects: Sequence[Effect], proposal: Proposal) -> tuple[float, float]:
    """Largest share of the signature, over the forms of an effect, if a proposal is made as well.

    Also the probability that it is seen then.
    """
    wider = replace(problem, blocks=problem.blocks + proposal.blocks)
    able, _ = fitted_to(tuple(effects), wider)
    made, starts = as_cut(base, proposal.blocks)
    new = replace(base, blocks=tuple(made), nuisance=starts)
    shares = [(0.0, 0.0)]
    for effect in able:
        candidate = Candidate(problem.base, (effect,))
        now, more = sensitivity(candidate, base), sensitivity(candidate, new)
        share = unabsorbed_share(now + more * MOST_REPEATS, len(base.beta))
        made_twice = now + more * TWICE
        size = (
            made_twice.total * unabsorbed_share(made_twice, len(base.beta)) * effect.parameters[0].scale ** 2
        )
        shares.append((share, deciding(0.5 * size, math.sqrt(size))))
    return max(shares)
