"""How far a run may be from a right model: within-run error, model-form budget, run-to-run scatter.

The covariance of a block is ``D + U Uᵀ``. ``D`` is diagonal: the standard error within the run, and the
declared budget for what a simple model never gets exactly right. ``U`` holds what a whole run shares: each
base parameter a little off (its column of the design times the scatter), and the zeros. Without ``U``, 10^5
samples make everything significant.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from itertools import combinations

import numpy as np

from metro.observables.problem import Block
from metro.units import Array

PRIOR_RUNS = 4  # for which what is declared of scatter and zeros counts
MISFIT_CORRELATION = 12.0  # neighbouring elements of a misfit that count as one piece of evidence
# Of the way to the misfit estimated: a larger one lets the elements that are measured best weigh less, and is
# then estimated smaller, so that whole steps would go to and fro about the point where it stays.
MISFIT_STEP = 0.5
# One less the squared cosine of signals² and of one size for all: from there on they are told from one size,
# and what is missed whatever the signal from what grows with it. Signals that scatter by a tenth reach it.
ONE_SIZE = 0.03
SAME = 1e-3  # relative difference of all that a noise consists of, below which no weight changes that counts
LARGEST_ZERO = 4.0  # of its deviation: a zero that is farther off is something else that is taken for it


@dataclass(frozen=True, eq=False)
class Noise:
    """The noise of an observable.

    Attributes
    ----------
    budget : relative model-form budget.
    scatter : (p,) relative run-to-run standard deviation of each base parameter; 0: the same in every run.
    zero_factor : estimated size of the zeros in units of each block's ``zero_sd``.
    repeats : runs per condition: the budget is shared by the repeats of a condition, so it does not average
        out over them.
    everywhere : conditions that what a model gets wrong is shared by, too.
    alike : how much of the error that repeats may share (``Block.alike``) they do share, as a part of its
        variance; the rest is each run's own. All of it, until the repeats tell.
    misfit : by axis, relative rms of what the model at hand misses, spread evenly over the elements. It is
        estimated with each fit, so that a model that misses much does not bend its parameters to please the
        elements that are measured best. What is missed is a smooth shape, the same in every run: about twelve
        neighbouring elements count as one piece of evidence.
    level : by axis, rms (SI) of what it misses whatever the size of the signal: the waves that gears leave on
        a wall are as high after a light cut as after a heavy one. Runs with other signals tell it apart.
    """

    budget: float
    scatter: Array
    repeats: dict[str, float]
    zero_factor: float = 1.0
    everywhere: float = 1.0
    alike: float = 1.0
    misfit: dict[str, float] = field(default_factory=dict)
    level: dict[str, float] = field(default_factory=dict)

    @cached_property
    def scattering(self) -> np.ndarray:
        """Places of the base parameters that differ from run to run."""
        return np.flatnonzero(self.scatter)

    @cached_property
    def sound(self) -> Noise:
        """The noise of a model that misses nothing."""
        return replace(self, misfit={}, level={})

    def alone(self, block: Block) -> Noise:
        """Return the noise of one waveform of a block by itself, of a model that misses nothing."""
        return replace(self.sound, repeats={block.condition: 1.0 / block.repeats})


@dataclass(frozen=True)
class Whitener:
    """The inverse square root of a block's covariance, in factored form: 1 − vectors × shrink × vectorsᵀ.

    ``log_shared``: what the shared directions add to the logarithm of the covariance's determinant.
    """

    inverse_sd: Array
    vectors: Array
    shrink: Array
    log_shared: float

    def __call__(self, values: Array) -> Array:
        """Apply to a vector (n,) or to the columns of a matrix (n, k)."""
        scaled = (values.T * self.inverse_sd).T
        weights = self.vectors.T @ scaled
        return np.asarray(scaled - self.vectors @ (weights.T * self.shrink).T)


def first_noise(budget: float, scatter: Array, blocks: Sequence[Block]) -> Noise:
    """Return the noise before anything is known of the repeats."""
    return Noise(budget, np.asarray(scatter, dtype=float), {**Counter(block.condition for block in blocks)})


@lru_cache(maxsize=1024)
def _axes(block: Block) -> tuple[tuple[str, ...], np.ndarray, Array]:
    """Names of a block's axes, the number of each element's axis, and the rms of its axis's signal."""
    names, number = np.unique(block.axis.astype(str), return_inverse=True)
    signal = block.measured if block.scale is None else block.scale
    power = np.bincount(number, signal**2) / np.bincount(number)
    return tuple(names.tolist()), number, np.sqrt(power)[number]


@lru_cache(maxsize=512)
def diagonal(block: Block, noise: Noise, correlation: float = MISFIT_CORRELATION) -> Array:
    """Variance of each element that nothing else shares, (n,).

    What all repeats share counts as many times as there are repeats. The misfit counts ``correlation``
    times, so that that many elements weigh as one.
    """
    scale = _axes(block)[2] if block.scale is None else block.scale
    repeats = noise.repeats.get(block.condition, 1) * block.repeats
    alike = 0.0 if block.alike is None else block.alike**2 * (1.0 + noise.alike * (repeats - 1.0))
    wrong = (noise.budget * scale) ** 2 + correlation * missed(block, noise)
    variance = np.asarray(block.sigma**2 + alike + repeats * noise.everywhere * wrong)
    variance.flags.writeable = False
    return variance


def missed(block: Block, noise: Noise) -> Array:
    """Mean square of what the model misses, by element (n,), SI². It is zero in a load test."""
    names, number, rms = _axes(block)
    if block.role == "calibrate":
        return np.zeros(len(rms))
    share, level = (
        np.array([part.get(name, 0.0) for name in names])[number] for part in (noise.misfit, noise.level)
    )
    return np.asarray((share * rms) ** 2 + level**2)


def misses(noise: Noise) -> bool:
    """Whether the model is known to miss anything."""
    return any(noise.misfit.values()) or any(noise.level.values())


def within_budget(blocks: Sequence[Block], noise: Noise) -> bool:
    """Whether the model misses less in every block than it is allowed to get wrong."""
    return all(
        bool((missed(block, noise) < (noise.budget * _axes(block)[2]) ** 2).all())
        for block in blocks
        if block.role != "calibrate"
    )


def all_alike(noise: Noise) -> Noise:
    """Return the noise for intervals: what a model gets wrong may be the same in all conditions.

    Then more conditions do not average it out, any more than repeats do.
    """
    return replace(noise, everywhere=float(len(noise.repeats)))


def log_determinant(block: Block, noise: Noise, directions: Array, whiten: Whitener) -> float:
    """Logarithm of the determinant of a block's covariance, in units that every model shares.

    The unshared variance counts in units of that without a misfit, elements as in :func:`diagonal`, and less
    one for each element: elements that a misfit leaves uncounted must gain nothing by it, whatever the unit.
    They also say less about the errors that a whole run shares. That must gain nothing either: else a model
    that misses a little is likelier than one that misses nothing.
    """
    known = diagonal(block, noise.sound)
    if not misses(noise):
        return whiten.log_shared - len(known)
    once, counted = diagonal(block, noise, correlation=1.0), diagonal(block, noise)
    scaled = directions / np.sqrt(known)[:, None]
    log_shared = np.linalg.slogdet(np.eye(scaled.shape[1]) + scaled.T @ scaled)[1]
    return float(np.sum(once / counted * (np.log(once / known) - 1.0)) + log_shared)


def shared(block: Block, noise: Noise, design: Array, beta: Array) -> Array:
    """Directions of the errors that the whole block shares, (n, k), each of one standard deviation."""
    zeros = block.zeros * (block.zero_sd * noise.zero_factor)
    unidentified = zeros[:, :0] if block.unidentified is None else block.unidentified
    if block.role == "calibrate":
        return np.hstack([zeros, unidentified])
    at = noise.scattering
    return np.hstack([design[:, at] * (beta[at] * noise.scatter[at]), zeros, unidentified])


def whitener(variance: Array, directions: Array) -> Whitener:
    """Factor the covariance ``diag(variance) + directions @ directionsᵀ``."""
    inverse_sd = 1.0 / np.sqrt(variance)
    scaled = inverse_sd[:, None] * directions[:, directions.any(axis=0)]
    power, turn = np.linalg.eigh(scaled.T @ scaled)
    power = np.maximum(power, 0.0)
    root = np.sqrt(1.0 + power)
    # 1 − 1/root over the power, without the loss of digits where there is next to none of it.
    shrink, log_shared = 1.0 / (root * (1.0 + root)), float(np.sum(np.log1p(power)))
    return Whitener(inverse_sd, scaled @ turn, shrink, log_shared)


def block_sigma(block: Block, noise: Noise, design: Array, beta: Array) -> Array:
    """Return the standard deviation of measured less predicted, per row of the comparison table, (m,)."""
    unshared, directions = diagonal(block, noise.alone(block)), shared(block, noise, design, beta)
    if block.synthesis is None:
        return np.asarray(np.sqrt(unshared + (directions**2).sum(axis=1)))
    spread = block.synthesis**2 @ unshared + ((block.synthesis @ directions) ** 2).sum(axis=1)
    return np.asarray(np.sqrt(spread))


def updated(noise: Noise, prior: Noise, parts: Sequence[tuple[Block, Array, Array]]) -> Noise:
    """One step of expectation–maximisation for scatter, zeros and misfit, and what repeats share.

    Scatter and zeros are drawn towards the prior, as if it were ``PRIOR_RUNS`` runs. What is believed to be
    of a size scatters by no more than it may be off.

    Parameters
    ----------
    parts : for each run: block, residual (n,), and directions (n, k) under ``noise``. The first p directions
        of a run are those of the base parameters that scatter, then come its zeros.
    """
    at = prior.scattering
    p = len(at)
    amplitudes = {"scatter": [1.0] * PRIOR_RUNS, "zero": [1.0] * PRIOR_RUNS}
    size = float(np.mean(noise.scatter[at] / prior.scatter[at])) if p else 1.0
    moments: dict[str, Array] = {}
    residuals: list[tuple[Block, Array, Array]] = []
    largest = min((_may_be_off(block) for block, _, _ in parts if block.belief), default=np.inf)
    for block, residual, directions in parts:
        if block.role == "calibrate":
            continue
        variance = diagonal(block, noise)
        deviation, uncertain = amplitude(directions, residual, variance)
        expected = deviation**2 + np.diag(uncertain)
        amplitudes["scatter"] += [float(size**2 * expected[:p].mean())] if p else []
        of_zeros = expected[p : p + block.zeros.shape[1]]
        amplitudes["zero"] += [float(noise.zero_factor**2 * of_zeros.mean())] if len(of_zeros) else []
        # The misfit as it is, not as it weighs: else it takes what the shared directions explain.
        deviation, uncertain = amplitude(directions, residual, diagonal(block, noise, correlation=1.0))
        left = residual - directions @ deviation
        residuals.append((block, left, variance))
        spread = left**2 + ((directions @ uncertain) * directions).sum(axis=1)
        excess = spread - diagonal(block, noise.sound)
        names, number, rms = _axes(block)
        kinds = np.stack([rms**2, np.ones_like(rms)]) / variance
        products = np.einsum("in,jn->nij", kinds, np.vstack([kinds, excess / variance]))
        for place, name in enumerate(names):
            moments[name] = moments.get(name, 0.0) + products[number == place].sum(axis=0)
    factor = {key: float(np.sqrt(np.mean(values))) for key, values in amplitudes.items()}
    misfit: dict[str, float] = {}
    level: dict[str, float] = {}
    for name, moment in moments.items():
        share, flat = _squares(moment)
        misfit[name] = _towards(share, noise.misfit.get(name, 0.0))
        level[name] = _towards(flat, noise.level.get(name, 0.0))
    return replace(
        noise,
        scatter=np.minimum(prior.scatter * factor["scatter"], largest),
        zero_factor=min(factor["zero"], LARGEST_ZERO),
        misfit=misfit,
        level=level,
        alike=_alike(residuals),
    )


def _may_be_off(block: Block) -> float:
    """Least relative error of what a block believes to be of a size; infinite of what has none."""
    sized = block.measured != 0.0
    return float(np.min(block.sigma[sized] / np.abs(block.measured[sized]), initial=np.inf))


def alike(one: Noise, other: Noise) -> bool:
    """Whether two noises, one estimated from the other, are the same but for what does not count."""
    first, second = (
        np.array([*each.scatter, each.zero_factor, each.alike, *each.misfit.values(), *each.level.values()])
        for each in (one, other)
    )
    return len(first) == len(second) and bool(np.allclose(first, second, rtol=SAME, atol=0.0))


def _towards(square: float, known: float) -> float:
    return math.sqrt(MISFIT_STEP * square + (1.0 - MISFIT_STEP) * known**2)


def _squares(moment: Array) -> tuple[float, float]:
    """Least squares for relative misfit² and level², neither of them negative.

    Where all runs have signals of one size nothing tells the two apart: then all is relative.

    Parameters
    ----------
    moment : (2, 3) normal equations with their right side.
    """
    (a, b, x), (_, c, y) = moment.tolist()
    determinant = a * c - b * b
    if a == 0.0:
        return 0.0, max(0.0, y) / c if c else 0.0
    if determinant > ONE_SIZE * a * c:
        share, level = (c * x - b * y) / determinant, (a * y - b * x) / determinant
        if share >= 0.0 and level >= 0.0:
            return share, level
        if share < 0.0:
            return 0.0, max(0.0, y) / c
    return max(0.0, x) / a, 0.0


def _alike(residuals: Sequence[tuple[Block, Array, Array]]) -> float:
    """How much of ``Block.alike`` repeats share, by the products of their residuals, plus a standard error.

    Parameters
    ----------
    residuals : for each run: block, what is left of it (n,), and its variance (n,).
    """
    shared, possible = 0.0, 0.0
    for (one, left, variance), (other, right, its) in combinations(residuals, 2):
        if one.condition != other.condition or one.alike is None or other.alike is None:
            continue
        if one.alike.shape == other.alike.shape:  # else they are not the same waves
            each = one.alike * other.alike / (variance * its)
            shared += float(each @ (left * right))
            possible += float(each @ (one.alike * other.alike))
    return min(1.0, max(0.0, shared / possible) + 1.0 / math.sqrt(possible)) if possible else 1.0


def amplitude(directions: Array, residual: Array, variance: Array) -> tuple[Array, Array]:
    """Return the expected amplitude of each shared direction (k,), and the covariance of that."""
    scaled = directions / np.sqrt(variance)[:, None]
    covariance = np.asarray(np.linalg.inv(np.eye(scaled.shape[1]) + scaled.T @ scaled), dtype=float)
    return covariance @ (scaled.T @ (residual / np.sqrt(variance))), covariance
