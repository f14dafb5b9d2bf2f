"""What speaks for an effect: evidence on the runs of the fit, on conditions left out, and its size.

The unit of evidence is the run, and for generality the condition; never the sample.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from metro.loop.checks.left_out import LeftOut, left_out, most_missed
from metro.loop.checks.predictive import predictive
from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Fit
from metro.loop.fitting.noise import PRIOR_RUNS, Noise
from metro.loop.fitting.system import (
    State,
    inverse,
    linearised,
    normal_equations,
    solution,
)
from metro.units import Array

FAULTY = 0.01  # share of conditions that are another than their files say
TOUCHED = 0.01  # of the largest gain or loss at a left-out condition: below it, the condition is not touched


@dataclass(frozen=True)
class Evidence:
    """How a larger candidate compares with a smaller one.

    Attributes
    ----------
    statistic : twice the gain in log-likelihood. p_value : of it, by F with run-level degrees of freedom.
    held_out : gain in log-likelihood of each condition when it is left out of both fits; empty where that was
        not worth computing.
    moved : rms change of the prediction over the rms of the signal.
    size : the same, with what the base parameters are spared of straying from what is believed of them
        (:func:`spared`).
    missed : rms of what the larger candidate misses beyond the noise, over that of the signal.
    sought : number of places among which the additional effects were sought, on all runs.
    """

    statistic: float
    p_value: float
    held_out: dict[str, float]
    moved: float
    size: float
    missed: float
    sought: float = 1.0

    @property
    def gain(self) -> float:
        """Sum of the held-out gains, less what the best of the places sought gains by chance."""
        return sum(self.held_out.values()) - math.log(self.sought)

    @property
    def better_share(self) -> float:
        """Share of the left-out conditions that the larger candidate predicts better.

        Those that it hardly touches (an orbit that only holes have) say nothing either way.
        """
        gains = np.array([*self.held_out.values()])
        touched = gains[np.abs(gains) > TOUCHED * np.abs(gains).max(initial=0.0)]
        return float(np.mean(touched > 0)) if len(touched) else 0.0


def compare(smaller: Fit, larger: Fit) -> Evidence:
    """Compare two fits of the same blocks; nothing is left out yet (:func:`hold_out` does that)."""
    runs = sum(block.role != "calibrate" for block in larger.blocks)
    statistic = 2.0 * (larger.total - smaller.total)
    parameters = len(larger.theta) - len(smaller.theta) + runs * (_own(larger) - _own(smaller))
    sought = _sought(larger) / _sought(smaller)
    p_value = -math.expm1(sought * math.log1p(-min(tail(statistic, parameters, runs), 1.0 - 1e-16)))
    moved = change(smaller, larger)
    size = math.hypot(moved, spared(smaller, larger))
    return Evidence(statistic, p_value, {}, moved, size, missed(larger), sought)


def hold_out(evidence: Evidence, smaller_out: Mapping[str, float], larger: Fit, prior: Noise) -> Evidence:
    """Add each condition's gain when left out; ``smaller_out`` is :func:`leave_out` of the smaller fit."""
    out = leave_out(larger, prior)
    # Where neither predicts a condition, as where all runs are of one, nothing is gained.
    gains = {name: 0.0 if out[name] == value else out[name] - value for name, value in smaller_out.items()}
    return replace(evidence, held_out=gains)


def _sought(fitted: Fit) -> float:
    return math.prod(effect.sought for effect in fitted.candidate.effects)


def _own(fitted: Fit) -> int:
    """Count the unknowns that the effects of a fit give each run."""
    return sum(effect.own for effect in fitted.candidate.effects)


def tail(statistic: float, parameters: int, runs: int) -> float:
    """P-value of twice a gain in log-likelihood by so many parameters: F on run-level degrees of freedom."""
    from scipy.stats import f

    return float(f.sf(max(statistic, 0.0) / parameters, parameters, runs + PRIOR_RUNS))


def relieved(smaller: Fit, larger: Fit) -> float:
    """Rms strain that base parameters lose against what is believed of them, over that measured.

    An effect that they stand in for changes no prediction, but spares them a strain. Squares add up: it is
    the root of what the mean square of the strain falls by.
    """
    before, after, signal = _strains(smaller, larger)
    return math.sqrt(max(float(before @ before) - float(after @ after), 0.0) / signal)


def spared(smaller: Fit, larger: Fit) -> float:
    """Rms of the change of what base parameters stand in for, over that measured; 0 where they strain more.

    An effect that they stand in for is as large as that. One that eases a large strain δ by a little ε
    relieves √(2 ε δ) of it, which is far more than there is of the effect itself.
    """
    before, after, signal = _strains(smaller, larger)
    change = before - after
    return math.sqrt(float(change @ change) / signal) if before @ before > after @ after else 0.0


def _strains(smaller: Fit, larger: Fit) -> tuple[Array, Array, float]:
    """Return what the runs show of the strain of base parameters under two fits, and the squares measured."""
    model, beliefs = smaller.candidate.model(smaller.theta), [b for b in smaller.blocks if b.belief]
    if not beliefs:
        return np.zeros(1), np.zeros(1), 1.0
    rows = [model.design(b, smaller.nuisance[b.run], smaller.beta)[0] for b in beliefs]
    of, right = np.vstack(rows), np.concatenate([b.measured for b in beliefs])
    known, believed = np.linalg.lstsq(of, right)[0], of.any(axis=0)
    runs = [block for block in smaller.blocks if block.role != "calibrate"]
    designs = np.vstack([model.design(b, smaller.nuisance[b.run], smaller.beta)[0] for b in runs])
    before, after = (designs @ np.where(believed, one.beta - known, 0.0) for one in (smaller, larger))
    return before, after, sum(float(np.sum(block.measured**2)) for block in runs)


def change(smaller: Fit, larger: Fit) -> float:
    """Rms difference of two fits' predictions over the rms measured, over the runs, not the load tests."""
    difference, signal = 0.0, 0.0
    for block in larger.blocks:
        if block.role != "calibrate":
            difference += float(np.sum((larger.predict(block) - smaller.predict(block)) ** 2))
            signal += float(np.sum(block.measured**2))
    return math.sqrt(difference / signal)


def missed(fitted: Fit) -> float:
    """Rms of what a fit misses beyond the noise over the rms measured, over the runs, not the load tests."""
    lost, signal = 0.0, 0.0
    for block in fitted.blocks:
        if block.role != "calibrate":
            lost += float(noise_room.missed(block, fitted.noise).sum())
            signal += float(np.sum(block.measured**2))
    return math.sqrt(lost / signal)


@lru_cache(maxsize=256)
def leave_out(fitted: Fit, prior: Noise, moved: Callable[[Fit], Fit] | None = None) -> dict[str, float]:
    """Log-likelihood of each condition under the fit of all others; of each run if there is one condition.

    An unknown of a run itself is fitted to the run that is predicted, which gains that much by chance: one is
    taken off for each. ``moved`` puts the fit of all others where something else than these runs wants it.
    What is believed of the base parameters beforehand counts by how likely the whole fit leaves it, and what
    was measured without a cut as :func:`_without_cut` says.
    """
    known, chance = (moved(fitted) if moved else fitted).noise, _own(fitted)
    believed = {b.condition: fitted.log_likelihood[b.run] for b in fitted.blocks if b.belief}
    return (
        believed
        | _without_cut(fitted)
        | {
            name: sum(_log_likelihood(part, moved, known) - len(part.blocks) * chance for part in parts)
            if parts
            else -math.inf
            for name, parts in left_out(fitted, prior).items()
        }
    )


def _without_cut(fitted: Fit) -> dict[str, float]:
    """Log-likelihood of what was measured without a cut (load tests), as if each of them were left out.

    That is to first order: a fit makes a block likelier by its part of the fit's parameters, which is the
    trace of their covariance with the block's normal matrix (Stone 1977, J. R. Stat. Soc. B 39, 44).
    """
    if all(block.role != "calibrate" or block.belief for block in fitted.blocks):
        return {}
    state = State(fitted.theta, fitted.beta, dict(fitted.nuisance))
    system = linearised(fitted.candidate, fitted.blocks, fitted.noise, state)
    covariance = inverse(normal_equations(system)[0])
    covariance = np.where(np.isfinite(covariance), covariance, 0.0)  # of what no block says anything
    likelihood = {}
    for block, (_, base, effects, _) in zip(fitted.blocks, system.rows, strict=True):
        if block.role == "calibrate" and not block.belief:
            rows = np.hstack([base, effects])
            part = float(np.sum((rows @ covariance) * rows))
            likelihood[block.condition] = fitted.log_likelihood[block.run] - part
    return likelihood


def most_left_out(fitted: Fit, like: Mapping[str, float]) -> dict[str, float]:
    """Return what :func:`leave_out` hardly exceeds, keyed as that of another fit of the same runs, ``like``.

    A fit that has seen the runs makes them likelier than one that has not, summed over them; a single
    condition may by chance be the other way round. No condition is left out here.
    """
    likelihood = dict.fromkeys(like, 0.0)
    for block in fitted.blocks:
        name = block.condition if block.condition in likelihood else block.run
        if name in likelihood:
            likelihood[name] += fitted.log_likelihood[block.run]
    return likelihood


def by_condition(fitted: Fit) -> dict[str, float]:
    """Log-likelihood of each condition on the runs of the fit, less what its parameters gain by chance.

    That is one for each parameter (Stone 1977, J. R. Stat. Soc. B 39, 44) and each unknown of a run itself.
    """
    likelihood: dict[str, float] = {}
    for block in fitted.blocks:
        own = 0 if block.role == "calibrate" else _own(fitted)
        likelihood[block.condition] = (
            likelihood.get(block.condition, 0.0) + fitted.log_likelihood[block.run] - own
        )
    each = len(fitted.theta) / len(likelihood)
    return {name: value - each for name, value in likelihood.items()}


def _log_likelihood(part: LeftOut, moved: Callable[[Fit], Fit] | None, known: Noise) -> float:
    """Log-likelihood of what was left out; ``known``: the noise by all runs."""
    others = moved(part.others) if moved else part.others
    return predictive(most_missed(others, known), part.blocks)


def weights(
    held_out: Sequence[dict[str, float]], seed: int, draws: int = 2000, prior: Sequence[float] | None = None
) -> Array:
    """Pseudo-BMA weights of candidates by Bayesian bootstrap over conditions, (candidates,).

    Any condition may be another than its files say, in a way that no effect knows: then it is as likely under
    each effect. So no single condition decides between effects. The first candidate has none of them.

    Parameters
    ----------
    held_out : for each candidate, its held-out log-likelihood (or gain over a common reference) by condition.
    prior : weight of each candidate before anything is known; None: all alike.
    """
    names = list(held_out[0])
    table = np.array([[candidate[name] for name in names] for candidate in held_out])
    effects = table[1:]
    finite = np.where(np.isfinite(effects), effects, -np.inf)
    best = finite.max(axis=0, initial=-np.inf)
    faulty = np.logaddexp(finite + math.log1p(-FAULTY), best + math.log(FAULTY))
    # What has no prediction of a condition is no better for that it may be another one.
    table = np.vstack([table[:1], np.where(np.isfinite(effects), faulty, effects)])
    known = table[np.isfinite(table)]
    table = np.clip(table, known.min() - 100.0, known.max() + 100.0) if known.size else np.zeros_like(table)
    share = np.random.default_rng(seed).dirichlet(np.ones(len(names)), size=draws) * len(names)
    total = share @ table.T + np.log(np.ones(len(table)) if prior is None else prior)
    likelihood = np.exp(total - total.max(axis=1, keepdims=True))
    return np.asarray((likelihood / likelihood.sum(axis=1, keepdims=True)).mean(axis=0))


def surviving_share(candidate: Candidate, base: Fit) -> float:
    """Share of an effect's signature that the base parameters and the runs' unknowns cannot absorb (0…1).

    The signature is the change of the prediction with the effect's first parameter, its size, near the first
    start. Near zero, the data cannot speak of the effect: the base absorbs it.
    """
    return unabsorbed_share(sensitivity(candidate, base), len(base.beta) + len(base.theta))


def seen_from(candidate: Candidate, base: Fit) -> float:
    """Return three standard errors of an effect's first parameter, its size, beside the base parameters.

    Of a strong signature, little may survive in them and yet be far above the noise.
    """
    left = surviving_share(candidate, base) * sensitivity(candidate, base).total
    return 3.0 / math.sqrt(left) if left > 0 else math.inf


@dataclass(frozen=True)
class Dimmed:
    """What the base parameters and the zeros of the runs leave of an effect.

    ``share`` of its signature; ``least``: three standard errors of its first parameter, its size.
    """

    share: float
    least: float


def dimmed(candidate: Candidate, base: Fit) -> Dimmed:
    """Return what the base parameters and the zeros of the runs, known to some error, leave of an effect.

    Unlike what the base parameters absorb, an effect that is much larger than the zeros is seen all the same.
    """
    place = len(base.beta) + len(base.theta)
    whole = sensitivity(candidate, replace(base, noise=replace(base.noise, zero_factor=0.0))).total
    seen = sensitivity(candidate, base)
    left = unabsorbed_share(seen, place) * seen.total
    return Dimmed(left / whole if whole > 0 else 0.0, 3.0 / math.sqrt(left) if left > 0 else math.inf)


@dataclass(frozen=True)
class Sensitivity:
    """What runs say of an effect not there yet: its whitened sum of squares, and the normal matrix."""

    total: float
    normal: Array

    def __add__(self, other: Sensitivity) -> Sensitivity:
        """Put two sets of runs together."""
        return Sensitivity(self.total + other.total, self.normal + other.normal)

    def __mul__(self, repeats: int) -> Sensitivity:
        """Make the runs several times."""
        return Sensitivity(self.total * repeats, self.normal * repeats)


@lru_cache(maxsize=64)
def sensitivity(candidate: Candidate, base: Fit) -> Sensitivity:
    """Return the signature of the effects that a candidate has more than the fit ``base``, in its blocks."""
    theta = np.concatenate([base.theta, [p.starts[0] for p in candidate.parameters[len(base.theta) :]]])
    system = linearised(candidate, base.blocks, base.noise, State(theta, base.beta, dict(base.nuisance)))
    first = len(base.theta)
    total = sum(float(effect[:, first] @ effect[:, first]) for _, _, effect, _ in system.rows)
    normal, _ = normal_equations(replace(system, weight=np.zeros_like(system.weight)))
    return Sensitivity(total, normal)


def unabsorbed_share(seen: Sensitivity, place: int) -> float:
    """Share of the signature of parameter ``place`` that those before it leave."""
    known, mixed = seen.normal[:place, :place], seen.normal[:place, place]
    left = seen.normal[place, place] - mixed @ solution(known, mixed)
    return max(0.0, float(left)) / seen.total if seen.total > 0 else 0.0
