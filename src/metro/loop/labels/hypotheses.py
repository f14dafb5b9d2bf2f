"""Hypotheses on labels: sets of effects, their parameters drawn from their prior, and what they predict.

Nothing is fitted: an effect is weighed by its marginal likelihood over the parameters that it may have.
Parameters are points of a unit cube in which the prior is uniform. A quasi-random set covers it; where
the tests leave but a few of its points, more are drawn about these, again and again, and all are weighed by
the density that they were drawn from (adaptive multiple importance sampling, Cornuet et al., Scand. J. Stat.
39 (2012) 798).

The boundary is solved at some of the points: first all over the prior, then where the tests leave them. At
the others it is a quick estimate, corrected by what was learnt where it was solved
(:mod:`metro.kriging`); how unsure that correction is counts as uncertainty of the boundary.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from metro.effects.effect import Effect, EffectParameter, by_name
from metro.kriging import krige
from metro.loop.labels.evidence import Errors, Labels, Likelihood, log_evidence, of_errors, posterior
from metro.loop.labels.points import Nearby, about, count_of, thinned, values
from metro.units import JSON, Array

ROUNDS = 12  # sets after the first, at most
_ENOUGH, _ENOUGH_JOINED = 100.0, 50.0  # effective points at which no more are drawn
_SURE = 0.04  # mean deviation of the log depth that is learnt, at which no more are solved
_SPREAD, _SPREAD_EACH = 8, 4  # points of the first set where the boundary is solved, and of each parameter
_BEYOND = 1.0  # natural logarithm of depth beyond those tested, at which boundaries are all alike
Change = Callable[[Any], Any]
Predict = Callable[[Sequence[Change]], tuple[Array, Array]]


@dataclass(frozen=True)
class LabelEvidence:
    """What hypotheses are weighed by.

    Attributes
    ----------
    predict : ``predict(changes)`` are the log depths and the chatter frequencies (t, p) of the boundary at
        all points, after each of t changes of the models.
    estimate : the same, roughly and quickly.
    tests : with their labels. errors : of the models.
    seed : of the draws.
    """

    predict: Predict
    estimate: Predict
    tests: Labels
    errors: Errors
    seed: int

    @cached_property
    def likelihood(self) -> Likelihood:
        """What the tests say of boundaries."""
        return Likelihood.of(self.tests, self.errors)

    def testable(self, log_depth: Array) -> Array:
        """Return log depths, within the range in which the tests can distinguish them."""
        tested = self.tests.depth
        return np.clip(log_depth, tested.min() - _BEYOND, tested.max() + _BEYOND)


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """Effects and what they predict, for t values of their parameters.

    Attributes
    ----------
    effects : those that act; none: the base model.
    cube : (t, d) points of the unit cube, a coordinate for each parameter that is sought.
    theta : (t, n) all parameters there, in the units of the contract.
    prior : (t,) weights.
    depth, chatter : (t, p) log depth (m) and chatter frequency (Hz) at the boundary, at all points.
    unsure : (t, p) standard deviation of ``depth``, as far as it is not solved but learnt.
    likelihood : (t, s, j) log-likelihood of the tests at each speed, for s draws of the errors.
    drawn : how the values were drawn; None where there are none.
    """

    effects: tuple[Effect, ...]
    cube: Array
    theta: Array
    prior: Array
    depth: Array
    chatter: Array
    unsure: Array
    likelihood: Array
    drawn: _Drawn | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(effect.name for effect in self.effects)

    @property
    def log_evidence(self) -> float:
        """Log of the marginal likelihood of the tests."""
        return log_evidence(self.likelihood, self.prior)

    @property
    def weights(self) -> Array:
        """(t,) posterior weights of the parameters."""
        return posterior(self.likelihood, self.prior)

    def of_errors(self, errors: Errors) -> Array:
        """(s,) weights of the draws of the errors, by their sizes."""
        return of_errors(self.likelihood, self.prior, errors)

    @property
    def in_doubt(self) -> Array:
        """(t,) shares of what the boundary, where it is learnt, leaves open of the weights."""
        doubt = self.weights * self.unsure.mean(axis=1)
        return np.asarray(doubt / doubt.sum())

    @property
    def likeliest(self) -> Callable[[Any], Any]:
        """Return what the effects do to a model with the parameters of the highest posterior density."""
        return changed(self, int(np.argmax(self.weights / self.prior)))

    def parameters(self, name: str) -> JSON:
        """Medians and 95 % intervals of the parameters of one effect; of a choice, the likelier one."""
        parameters = _parameters(self.effects)
        place = [i for i, (owner, _) in enumerate(parameters) if owner.name == name]
        entries = [_estimate(parameters[i][1], self.theta[:, i], self.weights) for i in place]
        return by_name(tuple(parameters[i][1] for i in place), entries)


def hypothesis(
    effects: tuple[Effect, ...],
    evidence: LabelEvidence,
    known: Hypothesis | None = None,
    rounds: int = ROUNDS,
) -> Hypothesis:
    """Draw the parameters of the effects and weigh them by the tests.

    ``known``: the hypothesis that the first of the effects act alone, about whose parameters more are drawn.
    ``rounds``: how many sets are drawn after the first, at most (:func:`pursued`).
    """
    from scipy.stats import qmc

    size = sum(not parameter.given for _, parameter in _parameters(effects))
    if not size:
        depth, chatter = evidence.predict([_change((), np.zeros(0))])
        sure = np.zeros_like(depth)
        likelihood = evidence.likelihood(depth, chatter)
        none = np.zeros((1, 0))
        return Hypothesis((), none, none, np.ones(1), depth, chatter, sure, likelihood)
    first = qmc.Sobol(size, seed=evidence.seed).random(count_of(size))
    drawn = _Drawn(effects, evidence, np.zeros((0, size)), joined=known is not None).longer(first)
    if known:
        drawn = drawn.about(known)
    drawn = drawn.solved_at(np.linspace(0, len(drawn.cube) - 1, drawn.spread).astype(int))
    return pursued(drawn.weighed(), rounds)


def pursued(one: Hypothesis, rounds: int = ROUNDS) -> Hypothesis:
    """Draw more points, and solve more boundaries, until that is enough or there are so many sets.

    It ends where it would have ended had it been drawn with so many sets at once.
    """
    while one.drawn and one.drawn.sets < rounds and not one.drawn.enough(one):
        one = one.drawn.further(one).weighed()
    return one


@dataclass(frozen=True)
class _Drawn:
    """Points (t, d) of the cube, the clouds that some were drawn from, and those that are solved.

    ``density`` (t,): sum of those of all sets, which have equally many points; 1 of the first. ``estimate``:
    log depth and frequency (t, p) at all; ``at`` (n,) indices and ``exact`` log depth and frequency (n, p) of
    those solved. ``sets``: drawn after the first. ``joined``: about what is known of one of two effects.
    """

    effects: tuple[Effect, ...]
    evidence: LabelEvidence
    cube: Array
    joined: bool
    sets: int = 0
    clouds: tuple[Nearby, ...] = ()
    density: Array = field(default_factory=lambda: np.zeros(0))
    estimate: tuple[Array, ...] = ()
    at: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))
    exact: tuple[Array, ...] = ()

    def longer(self, points: Array) -> _Drawn:
        """Estimate the boundary at more points."""
        estimate = self.evidence.estimate(
            [_change(self.effects, row) for row in _values(self.effects, points)]
        )
        density = 1.0 + sum((cloud.density(points) for cloud in self.clouds), np.zeros(len(points)))
        return replace(
            self,
            cube=np.concatenate([self.cube, points]),
            density=np.concatenate([self.density, density]),
            estimate=_longer(self.estimate, estimate),
        )

    def about(self, centre: Hypothesis) -> _Drawn:
        """Draw more points about the heavy ones of a hypothesis."""
        cloud = about(centre.weights, centre.cube, self._rng(1))
        known = replace(self, clouds=(*self.clouds, cloud), density=self.density + cloud.density(self.cube))
        return known.longer(cloud.drawn(self._rng(2), self.cube.shape[1]))

    def further(self, mine: Hypothesis) -> _Drawn:
        """Solve the boundary at more of the points, and draw one more set of these."""
        solved = self.solved_at(thinned(mine.in_doubt, self.spread // 2, self._rng(0)))
        return replace(solved.about(mine), sets=self.sets + 1)

    @property
    def spread(self) -> int:
        """At how many points of the first set the boundary is solved."""
        every: int = _SPREAD + _SPREAD_EACH * self.cube.shape[1]
        return every // 2 if self.joined else every

    def enough(self, mine: Hypothesis) -> bool:
        """Whether points were drawn again, many have a weight, and the boundary is known at these."""
        effective = 1.0 / np.sum(mine.weights**2)
        many = effective >= (_ENOUGH_JOINED if self.joined else _ENOUGH)
        return bool(self.sets and many and (mine.weights @ mine.unsure).mean() < _SURE)

    def _rng(self, purpose: int) -> np.random.Generator:
        return np.random.default_rng([self.evidence.seed, len(self.clouds), purpose])

    def solved_at(self, which: np.ndarray) -> _Drawn:
        """Solve the boundary at some of the points."""
        fresh = np.setdiff1d(which, self.at)
        if not len(fresh):
            return self
        changes = [_change(self.effects, row) for row in _values(self.effects, self.cube[fresh])]
        solved = self.evidence.predict(changes)
        return replace(self, at=np.append(self.at, fresh), exact=_longer(self.exact, solved))

    def weighed(self) -> Hypothesis:
        """Weigh all points by the tests."""
        (rough, hz), (solved, solved_hz), cube = self.estimate, self.exact, self.cube
        rough, solved = self.evidence.testable(rough), self.evidence.testable(solved)
        learnt = krige(cube[self.at], solved - rough[self.at])
        correction, unsure = learnt(cube)
        depth = rough + correction
        chatter = hz * (solved_hz / hz[self.at])[learnt.nearest(cube)]
        likelihood = self.evidence.likelihood(depth, chatter, unsure)
        prior = (1.0 / self.density) / np.sum(1.0 / self.density)
        theta = _values(self.effects, cube)
        return Hypothesis(self.effects, cube, theta, prior, depth, chatter, unsure, likelihood, self)


def _longer(first: tuple[Array, ...], second: tuple[Array, ...]) -> tuple[Array, ...]:
    return tuple(np.concatenate(pair) for pair in zip(first, second, strict=True)) if first else second


def _values(effects: tuple[Effect, ...], cube: Array) -> Array:
    return values([parameter for _, parameter in _parameters(effects)], cube)


def _applied(model: Any, effects: tuple[Effect, ...], theta: Array) -> Any:
    first = 0
    for effect in effects:
        last = first + len(effect.parameters)
        model = effect.apply(model, effect.values(theta[first:last]))
        first = last
    return model


def _change(effects: tuple[Effect, ...], theta: Array) -> Callable[[Any], Any]:
    return lambda model: _applied(model, effects, theta)


def changed(chosen: Hypothesis, which: int) -> Callable[[Any], Any]:
    """Return what the effects do to a model with their parameters of index ``which``."""
    return _change(chosen.effects, chosen.theta[which])


def _parameters(effects: tuple[Effect, ...]) -> list[tuple[Effect, EffectParameter]]:
    return [(effect, parameter) for effect in effects for parameter in effect.parameters]


def _estimate(parameter: EffectParameter, values: Array, weights: Array) -> JSON:
    if parameter.choices:
        share = [float(weights[values == i].sum()) for i in range(len(parameter.choices))]
        first = int(np.argmax(share))
        return {"value": parameter.choices[first], "ci95": None, "unit": "", "probability": share[first]}
    if parameter.given:
        return {"value": parameter.lower, "ci95": None, "unit": parameter.unit}
    order = np.argsort(values)
    below = np.cumsum(weights[order]) - 0.5 * weights[order]
    low, middle, high = np.interp([0.025, 0.5, 0.975], below, values[order])
    return {"value": float(middle), "ci95": [float(low), float(high)], "unit": parameter.unit}
