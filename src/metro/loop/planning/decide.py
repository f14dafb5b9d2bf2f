"""Which runs decide: one or two kinds of runs, so often that the verdict would name one cause of each pair.

The verdict keeps a rival as long as its weight over the conditions left out counts, unless it is far behind
on all runs (:mod:`metro.loop.search.rivals`). Runs of a new condition add one gain to those that there are:
before they are made it is normal, with the mean and the deviation of
:mod:`metro.loop.planning.experiment`. How often the verdict's own rule is met then is the probability of
deciding.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from metro.loop.checks.evidence import leave_out
from metro.loop.fitting.fit import Fit
from metro.loop.fitting.noise import Noise
from metro.loop.planning.experiment import ENOUGH, MOST_REPEATS, expected
from metro.loop.search.rivals import RIVAL_WEIGHT
from metro.loop.search.trial import HOPELESS
from metro.observables.problem import Proposal
from metro.units import Array

LEADING = 8  # proposals that are combined in twos
DRAWS, GAINS = 400, 64  # bootstraps over the conditions, and gains of the new ones
FAR = 100.0  # log-likelihood beyond which a condition speaks no louder


@dataclass(frozen=True, eq=False)
class Pair:
    """Two explanations of the same runs: the fit with what was chosen, and that with a rival in its place."""

    names: tuple[str, str]
    chosen: Fit
    rival: Fit


@dataclass(frozen=True)
class Kind:
    """Runs of one kind: a proposal, made so many times."""

    proposal: Proposal
    repeats: int

    @property
    def runs(self) -> int:
        """Number of runs to be made."""
        return self.repeats * len(self.proposal.blocks)


@dataclass(frozen=True)
class Plan:
    """Kinds of runs, and the probability with which they decide each pair, by the pair's names."""

    kinds: tuple[Kind, ...]
    chance: Mapping[tuple[str, str], float]

    @property
    def runs(self) -> int:
        """Number of runs to be made."""
        return sum(kind.runs for kind in self.kinds)


@dataclass(frozen=True, eq=False)
class _Odds:
    """What the runs that there are say of a pair.

    ``gains`` (conditions,): log-likelihood by which what was chosen is ahead where a condition is left out;
    ``ahead``: on all runs together; ``prior``: logarithm of its odds before any run.
    """

    gains: Array
    ahead: float
    prior: float


def plan(
    pairs: Sequence[Pair], proposals: Sequence[Proposal], prior: Noise, most: int, seed: int
) -> Plan | None:
    """Return the fewest runs that are likely to decide all pairs; else what decides them most probably.

    Parameters
    ----------
    proposals : to choose from. prior : the noise before anything was known. most : runs that may be made.
    """
    odds = [_odds(pair, prior) for pair in pairs]
    singles = [
        Kind(proposal, repeats)
        for proposal in proposals
        for repeats in range(1, MOST_REPEATS + 1)
        if repeats * len(proposal.blocks) <= most
    ]
    if not singles:
        return None
    tried: dict[tuple[Kind, ...], tuple[float, ...]] = {}
    best: dict[int, float] = {}
    for kind in singles:
        chance = tried[kind,] = _chances(pairs, odds, (kind,), seed)
        key = id(kind.proposal)
        best[key] = max(best.get(key, 0.0), float(np.mean(chance)))
    leading = sorted(best, key=lambda key: -best[key])[:LEADING]
    for one, other in itertools.combinations(singles, 2):
        apart = one.proposal is not other.proposal and one.repeats == other.repeats
        among = {id(one.proposal), id(other.proposal)} <= set(leading)
        if apart and among and one.runs + other.runs <= most:
            tried[one, other] = _chances(pairs, odds, (one, other), seed)
    kinds, chance = min(tried.items(), key=lambda item: _merit(pairs, *item))
    named = {pair.names: value for pair, value in zip(pairs, chance, strict=True)}
    return Plan(kinds, named)


def _merit(pairs: Sequence[Pair], kinds: tuple[Kind, ...], chance: Sequence[float]) -> tuple[float, ...]:
    """Fewest runs first among those that decide all, then the most probable, then those that part most."""
    runs = sum(kind.runs for kind in kinds)
    certain = round(float(np.mean(chance)), 2)
    gain = sum(
        min(means[kind.repeats - 1][0] for means in expected(pair.chosen, pair.rival, kind.proposal))
        for pair in pairs
        for kind in kinds
    )
    return (runs if min(chance) >= ENOUGH else math.inf), -certain, -gain


def _odds(pair: Pair, prior: Noise) -> _Odds:
    mine, others = (leave_out(fitted, prior) for fitted in (pair.chosen, pair.rival))
    gains = np.array([mine[name] - others[name] if math.isfinite(mine[name]) else 0.0 for name in mine])
    name = pair.names[0].partition(" (")[0]
    mine_odds = next(effect.odds for effect in pair.chosen.candidate.effects if effect.name == name)
    believed = (mine_odds, pair.rival.candidate.effects[-1].odds)
    return _Odds(gains, pair.chosen.total - pair.rival.total, math.log(believed[0] / believed[1]))


def _chances(
    pairs: Sequence[Pair], odds: Sequence[_Odds], kinds: Sequence[Kind], seed: int
) -> tuple[float, ...]:
    return tuple(_chance(pair, known, kinds, seed) for pair, known in zip(pairs, odds, strict=True))


def _chance(pair: Pair, known: _Odds, kinds: Sequence[Kind], seed: int) -> float:
    """Probability of deciding a pair, either of which is true with even odds."""
    rng = np.random.default_rng(seed)
    normal = rng.standard_normal((GAINS, len(kinds)))
    total = 0.0
    for truth, sign in enumerate((1.0, -1.0)):
        either = [expected(pair.chosen, pair.rival, kind.proposal)[truth] for kind in kinds]
        forecast = [each[kind.repeats - 1] for each, kind in zip(either, kinds, strict=True)]
        mean, deviation = np.array(forecast).T
        gains = mean + deviation * normal
        total += 0.5 * decided(sign * known.gains, gains, sign * known.ahead, sign * known.prior, rng)
    return total


def decided(known: Array, new: Array, ahead: float, prior: float, rng: np.random.Generator) -> float:
    """Share of the draws in which the rival of what is true is no longer named.

    Parameters
    ----------
    known : (conditions,) gains of the truth over its rival on conditions left out. new : (draws, k) gains on
        new conditions. ahead : log-likelihood by which the truth is ahead on all runs. prior : logarithm of
        its odds.
    """
    count = len(known) + new.shape[1]
    share = rng.dirichlet(np.ones(count), size=DRAWS) * count
    gain = np.clip(np.hstack([np.tile(known, (len(new), 1)), new]), -FAR, FAR)
    weight = np.mean(1.0 / (1.0 + np.exp(np.clip(gain @ share.T + prior, -500.0, 500.0))), axis=1)
    behind = ahead + new.sum(axis=1) > HOPELESS
    return float(np.mean((weight <= RIVAL_WEIGHT) | behind))
