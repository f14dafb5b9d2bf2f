"""Rivals: other effects in the place of one that was chosen, refitted with all the others.

An effect that was added first may have stood for one that fits better once the others are known; and what
explains the runs as well, those of the fit and conditions left out, is named beside it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from metro.effects.effect import Effect
from metro.loop.checks.evidence import by_condition, leave_out, most_left_out, weights
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Fit, Race, cost_under, fit
from metro.loop.fitting.noise import Noise
from metro.loop.fitting.race import raced
from metro.loop.search.replaceable import Change
from metro.loop.search.settled import beyond_left_out, unsettled
from metro.loop.search.trial import HOPELESS, Gates, parted, unlike
from metro.units import Array

NEGLIGIBLE = 1e-3  # weight that no report shows, and no decision depends on
RIVAL_WEIGHT = 0.05  # above it, another effect in the place of one that was chosen leaves it undecided


@dataclass(frozen=True)
class Rival:
    """An effect in the place of one that was chosen: names of both, weight of the other, and its fit.

    The names are with their forms (``friction_reversal (joint 3)``) where the rivals are one effect at two
    joints.
    """

    effect: str
    other: str
    weight: float
    fit: Fit

    @property
    def pair(self) -> tuple[str, str]:
        """The two names."""
        return self.effect, self.other


@dataclass(frozen=True)
class Contest:
    """The model after the contest, the weight of each of its effects, and the rivals that stay undecided."""

    final: Fit
    weight: dict[str, float] = field(default_factory=dict)
    rivals: tuple[Rival, ...] = ()


def believed(effect: Effect, weight: float, fitted: Fit) -> tuple[bool, bool, float]:
    """Order of belief: what is not of the library comes after all that is and has a weight that counts.

    Of the latter, an effect whose fit is a result comes before one whose parameters would have to be larger
    than they may be, or are not determined.
    """
    counts = not effect.resembled and weight > RIVAL_WEIGHT
    return counts and unsettled(fitted, effect) is None, counts, weight


def contested(base: Fit, current: Fit, effects: Sequence[Effect], prior: Noise, gates: Gates) -> Contest:
    """Weigh every effect chosen against each other effect in its place, and put the better one there.

    ``base`` : the fit without any effect, from which the models without one of them are built up.
    """
    swapped: set[tuple[str, str]] = set()
    while True:
        contest, better = _round(base, current, effects, prior, gates)
        if better is None or set(_keys(better)) <= swapped:
            return contest
        swapped |= set(_keys(current)) | set(_keys(better))
        current = better


def _titles(chosen: Effect, other: Effect) -> tuple[str, str]:
    """Names of two effects, with their forms where the name is the same."""
    return (chosen.name, other.name) if chosen.name != other.name else (chosen.title, other.title)


def _keys(fitted: Fit) -> list[tuple[str, str]]:
    return [effect.key for effect in fitted.candidate.effects]


def _round(
    base: Fit, current: Fit, effects: Sequence[Effect], prior: Noise, gates: Gates
) -> tuple[Contest, Fit | None]:
    """Contest each effect once; also the fit with the best rival in place, where one is better."""
    weight: dict[str, float] = {}
    rivals: list[Rival] = []
    better: Fit | None = None
    effects = [effect for effect in effects if not _leaves_much(current, effect, prior)]
    for effect in current.candidate.effects:
        smaller, current = parted(base, current, effect, prior)
        others = _replaced(current, smaller, effects, prior)
        in_place = [effect, *(fitted.candidate.effects[-1] for fitted in others)]
        odds = [1.0, *_odds(in_place, [current, *others])]
        share = _shares(smaller, [current, *others], odds, prior, gates)
        pooled = _pooled(in_place, share)
        weight[effect.name] = float(pooled[0])
        for fitted, one, other in zip(others, in_place[1:], share[1:], strict=True):
            if other > RIVAL_WEIGHT and _cause(one) != _cause(effect):
                rivals.append(Rival(*_titles(effect, one), float(other), fitted))
        belief = [
            (*believed(one, float(w), fitted), float(own))
            for one, w, fitted, own in zip(in_place, pooled, [current, *others], share, strict=True)
        ]
        first = belief.index(max(belief))
        if better is None and first > 0:
            better = others[first - 1]
    return Contest(current, weight, tuple(rivals)), better


def _cause(effect: Effect) -> tuple[str, object]:
    """Return what is to be mended: forms of an effect that differ in nothing but their law are one cause."""
    return effect.name, effect.where.get("joint")


def _pooled(effects: Sequence[Effect], share: Array) -> Array:
    """Return the weight of the cause of each effect: the sum of those of its forms."""
    causes = [_cause(effect) for effect in effects]
    return np.array(
        [sum(w for w, cause in zip(share, causes, strict=True) if cause == own) for own in causes]
    )


def _shares(smaller: Fit, fits: Sequence[Fit], odds: Sequence[float], prior: Noise, gates: Gates) -> Array:
    """Return the weight of each of ``fits``, by the conditions left out and by the runs of the fit alike.

    The ``smaller`` model, which has none of the effects, is one of the possibilities. Where its weight would
    be negligible even if it predicted what is left out as well as it describes what it has seen, nothing is
    left out of it: that takes as many fits as there are conditions.
    """
    within = [by_condition(fitted) for fitted in (smaller, *fits)]
    left_out = [leave_out(fitted, prior) for fitted in fits]
    share = weights([most_left_out(smaller, left_out[0]), *left_out], gates.seed, prior=odds)
    if share[0] > NEGLIGIBLE:
        share = weights([leave_out(smaller, prior), *left_out], gates.seed, prior=odds)
    return np.asarray(np.mean([share, weights(within, gates.seed, prior=odds)], axis=0)[1:])


def _leaves_much(current: Fit, effect: Effect, prior: Noise) -> bool:
    """Whether what is not of the library leaves a significant residual even beside all that was chosen.

    In the place of one of these effects it then leaves no less.
    """
    if not effect.resembled or effect.key in _keys(current):
        return False
    beside = Candidate(current.candidate.base, (*current.candidate.effects, effect))
    return unlike(effect, fit(beside, current.blocks, prior, current))


def _odds(effects: Sequence[Effect], fits: Sequence[Fit]) -> list[float]:
    """Return the odds of effects before the runs are seen, each at the size that its fit gives it.

    Of the forms of one effect, that with the more plausible size has the better ones: a gap of a joint's gear
    that is as wide as a worn one has, before one that is wider than any. Sizes of different effects are not
    compared.
    """
    strain = [_strain(effect, fitted) for effect, fitted in zip(effects, fits, strict=True)]
    least: dict[str, float] = {}
    for effect, far in zip(effects, strain, strict=True):
        least[effect.name] = min(far, least.get(effect.name, far))
    return [one.odds * math.exp(least[one.name] - far) for one, far in zip(effects, strain, strict=True)]


def _strain(effect: Effect, fitted: Fit) -> float:
    """Return minus the logarithm of how plausible the size of an effect is, but for a constant."""
    place = dict(fitted.candidate.parts(fitted.theta))[effect]
    sizes = zip(effect.parameters, fitted.theta[place].tolist(), strict=True)
    return 0.5 * math.fsum((size / one.plausible) ** 2 for one, size in sizes if one.plausible is not None)


def _replaced(current: Fit, smaller: Fit, effects: Sequence[Effect], prior: Noise) -> list[Fit]:
    """Fit every other effect in place of the one that ``smaller`` lacks; those not far behind.

    One that cannot make what that one makes is not fitted, and one that stays far behind is not followed to
    its end.
    """
    race = Race(cost_under(current, smaller.noise) + 2.0 * HOPELESS, current.total - HOPELESS)
    others = {effect.name for effect in smaller.candidate.effects}
    present = set(_keys(current))
    change = Change(smaller, current)
    fits = []
    for effect in effects:
        if effect.name not in others and effect.key not in present and change.could_be(effect):
            candidate = Candidate(current.candidate.base, (*smaller.candidate.effects, effect))
            fitted, behind = raced(candidate, smaller, prior, race)
            if not (behind or unlike(effect, fitted) or beyond_left_out(fitted, prior)):
                fits.append(fitted)
    return fits
