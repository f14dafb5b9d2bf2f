"""Hypotheses on labels: sets of effects, their parameters drawn from their prior, and what they predict.

Nothing is fitted: an effect is weighed by its marginal likelihood over the parameters that it may have.
Parameters are points of a unit cube in which the prior is uniform. A quasi-random set covers it; where
the tests leave but a few of its points, more are drawn about these, again and again, and all are weighed by
the density that they were drawn from (adaptive multiple importance sampling, Cornuet et al., Scand. J. Stat.
39 (2012) 798).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from metro.effects.effect import Effect, EffectParameter, by_name
from metro.loop.label_evidence import Labels, log_evidence, log_likelihood, posterior
from metro.units import JSON, Array

_MOST, _MOST_JOINED = 128, 32  # points of the first set; where another hypothesis tells where to draw more
_FEW, _MORE, _ROUNDS = 12.0, 48, 2  # effective points below which more are drawn, how many, how often
Predict = Callable[[Callable[[Any], Any]], tuple[Array, Array]]


@dataclass(frozen=True)
class Evidence:
    """What hypotheses are weighed by.

    Attributes
    ----------
    predict : ``predict(change)`` is the log depth (p,) and the chatter frequency (p,) at the boundary at all
        points, once ``change`` has been made to the models.
    tests : with their labels. deviations : (s, p) of the log depth, by what the base model is uncertain.
    seed : of the draws.
    """

    predict: Predict
    tests: Labels
    deviations: Array
    seed: int


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """Effects and what they predict, for t values of their parameters.

    Attributes
    ----------
    effects : those that act; none: the base model.
    cube : (t, d) points of the unit cube. theta : (t, d) parameters there, in the units of the contract.
    prior : (t,) weights.
    depth, chatter : (t, p) log depth (m) and chatter frequency (Hz) at the boundary, at all points.
    likelihood : (t, s, j) log-likelihood of the tests at each speed, for s deviations of the base.
    """

    effects: tuple[Effect, ...]
    cube: Array
    theta: Array
    prior: Array
    depth: Array
    chatter: Array
    likelihood: Array

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

    @property
    def likeliest(self) -> Callable[[Any], Any]:
        """Return what the effects do to a model with the parameters of the highest posterior density."""
        return changed(self, int(np.argmax(self.weights / self.prior)))

    def parameters(self, name: str) -> JSON:
        """Medians and 95 % intervals of the parameters of one effect; of a choice, the likelier one."""
        parameters = _parameters(self.effects)
        place = [i for i, (owner, _) in enumerate(parameters) if owner.name == name]
        entries = [_told(parameters[i][1], self.theta[:, i], self.weights) for i in place]
        return by_name(tuple(parameters[i][1] for i in place), entries)


def hypothesis(
    effects: tuple[Effect, ...], evidence: Evidence, known: Hypothesis | None = None
) -> Hypothesis:
    """Draw the parameters of the effects and weigh them by the tests.

    ``known``: the hypothesis that the first of the effects act alone, about whose parameters more are drawn.
    """
    from scipy.stats import qmc

    size = len(_parameters(effects))
    if not size:
        return _weighed(effects, np.zeros((1, 0)), evidence)
    count = min(_MOST_JOINED if known else _MOST, 2 ** (4 + size))
    rng = np.random.default_rng(evidence.seed)
    found = _weighed(effects, qmc.Sobol(size, seed=evidence.seed).random(count), evidence)
    nearby: list[_Nearby] = []
    for _ in range(_ROUNDS):
        centre = known if known and not nearby else found
        if centre is found and 1.0 / np.sum(found.weights**2) >= _FEW:
            break
        nearby.append(_about(centre, 0.5 ** len(nearby)))
        found = _joined(found, _weighed(effects, nearby[-1].drawn(rng, size), evidence))
        density = count + _MORE * sum(one.density(found.cube) for one in nearby)
        found = replace(found, prior=(1.0 / density) / np.sum(1.0 / density))
    return found


def _joined(first: Hypothesis, second: Hypothesis) -> Hypothesis:
    parts = {
        name: np.concatenate([getattr(first, name), getattr(second, name)])
        for name in ("cube", "theta", "prior", "depth", "chatter", "likelihood")
    }
    return Hypothesis(first.effects, **parts)


def _weighed(effects: tuple[Effect, ...], cube: Array, evidence: Evidence) -> Hypothesis:
    """Weigh points of the cube, each alike."""
    owned = _parameters(effects)
    theta = np.array([[quantile(p, float(u)) for (_, p), u in zip(owned, row, strict=True)] for row in cube])
    found = [evidence.predict(_change(effects, row)) for row in theta]
    depth, chatter = (np.stack(part) for part in zip(*found, strict=True))
    likelihood = log_likelihood(evidence.tests, depth, chatter, evidence.deviations)
    alike = np.full(len(cube), 1.0 / len(cube))
    return Hypothesis(effects, cube, theta, alike, depth, chatter, likelihood)


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


@dataclass(frozen=True)
class _Nearby:
    """Normal clouds about heavy points (h, c), folded back at the faces of the cube.

    They tell of its first c coordinates; the others are uniform. ``share`` (h,) of the points; ``width``.
    """

    centres: Array
    share: Array
    width: float

    def drawn(self, rng: np.random.Generator, size: int) -> Array:
        """Points (n, size)."""
        points = rng.random((_MORE, size))
        parents = rng.choice(len(self.centres), size=_MORE, p=self.share)
        near = self.centres[parents]
        near = np.abs(near + self.width * rng.standard_normal(near.shape))
        points[:, : near.shape[1]] = np.where(near > 1.0, 2.0 - near, near)
        return points

    def density(self, cube: Array) -> Array:
        """Density (t,) at points (t, d)."""
        from scipy.stats import norm

        at = cube[:, None, : self.centres.shape[1]]
        images = (self.centres, -self.centres, 2.0 - self.centres)
        density: Array = sum(norm.pdf(at, image, self.width) for image in images).prod(axis=2) @ self.share
        return density


def _about(centre: Hypothesis, shrunk: float) -> _Nearby:
    weights = centre.weights
    heavy = weights > 1e-3 * weights.max()
    first = min(_MOST, 2 ** (4 + centre.cube.shape[1]))
    width = 0.5 * shrunk * first ** (-1.0 / centre.cube.shape[1])
    return _Nearby(centre.cube[heavy], weights[heavy] / weights[heavy].sum(), width)


def quantile(parameter: EffectParameter, share: float) -> float:
    """Value of a parameter below which its prior has a ``share``.

    A choice: each alike. Plausible about zero: normal within the bounds. Positive: flat in the logarithm.
    """
    from scipy.stats import norm

    low, high = parameter.lower, parameter.upper
    if parameter.choices:
        return float(min(int(share * len(parameter.choices)), len(parameter.choices) - 1))
    if parameter.plausible is not None:
        below, above = norm.cdf([low / parameter.plausible, high / parameter.plausible])
        return float(parameter.plausible * norm.ppf(below + share * (above - below)))
    if low > 0.0:
        return float(low * (high / low) ** share)
    return low + share * (high - low)


def _parameters(effects: tuple[Effect, ...]) -> list[tuple[Effect, EffectParameter]]:
    return [(effect, parameter) for effect in effects for parameter in effect.parameters]


def _told(parameter: EffectParameter, values: Array, weights: Array) -> JSON:
    if parameter.choices:
        share = [float(weights[values == i].sum()) for i in range(len(parameter.choices))]
        first = int(np.argmax(share))
        return {"value": parameter.choices[first], "ci95": None, "unit": "", "probability": share[first]}
    order = np.argsort(values)
    below = np.cumsum(weights[order]) - 0.5 * weights[order]
    low, middle, high = np.interp([0.025, 0.5, 0.975], below, values[order])
    return {"value": float(middle), "ci95": [float(low), float(high)], "unit": parameter.unit}
