"""How far a run may be from a right model: within-run error, model-form budget, run-to-run scatter.

The covariance of a block is ``D + U Uᵀ``. ``D`` is diagonal: the standard error within the run, and the
declared budget for what a simple model never gets exactly right. ``U`` holds what a whole run shares: each
base parameter a little off (its column of the design times the scatter), and the zeros. Without ``U``, 10^5
samples make everything significant.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np

from metro.observables.problem import Block
from metro.units import Array

PRIOR_RUNS = 4  # for which what is declared of scatter and zeros counts
MISFIT_CORRELATION = 12.0  # neighbouring elements of a misfit that count as one piece of evidence
SAME = 1e-3  # relative difference of all that a noise consists of, below which no weight changes that counts


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
        variance; the rest is each run's own. All of it, until repeats determine it.
    misfit : by axis, relative rms of what the model at hand misses, spread evenly over the elements. It is
        estimated with each fit, so that a model that misses much does not bend its parameters to please the
        elements that are measured best. What is missed is a smooth shape, the same in every run: about twelve
        neighbouring elements count as one piece of evidence.
    level : by axis, rms (SI) of what it misses whatever the size of the signal: the waves that gears leave on
        a wall are as high after a light cut as after a heavy one. Runs with other signals separate them.
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
def axes(block: Block) -> tuple[tuple[str, ...], np.ndarray, Array]:
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
    variance = sound(block, noise) + correlation * apart(block, noise) * missed(block, noise)
    variance.flags.writeable = False
    return np.asarray(variance)


def sound(block: Block, noise: Noise) -> Array:
    """Variance of each element that nothing else shares where the model misses nothing, (n,).

    The budget counts for all runs that share what a model gets wrong.
    """
    scale = axes(block)[2] if block.scale is None else block.scale
    alike = 0.0 if block.alike is None else block.alike**2 * alike_times(block, noise)
    return np.asarray(block.sigma**2 + alike + apart(block, noise) * (noise.budget * scale) ** 2)


def alike_times(block: Block, noise: Noise) -> float:
    """Return how many times the error that repeats may share counts in one of them."""
    repeats = noise.repeats.get(block.condition, 1) * block.repeats
    return 1.0 + noise.alike * (repeats - 1.0)


def apart(block: Block, noise: Noise) -> float:
    """Return how many times what the model gets wrong counts in one of the runs that share it."""
    return noise.repeats.get(block.condition, 1) * block.repeats * noise.everywhere


def missed(block: Block, noise: Noise) -> Array:
    """Mean square of what the model misses, by element (n,), SI². It is zero in a load test."""
    names, number, rms = axes(block)
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
        bool((missed(block, noise) < (noise.budget * axes(block)[2]) ** 2).all())
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
    return columns(block, noise, design, beta) * sizes(block, noise)


def columns(block: Block, noise: Noise, design: Array, beta: Array) -> Array:
    """Directions (n, k) of what a whole block shares, for a scatter of one and for zeros as declared."""
    parts = [block.zeros * block.zero_sd]
    if block.unidentified is not None:
        parts.append(block.unidentified)
    if block.role != "calibrate":
        at = noise.scattering
        parts.insert(0, design[:, at] * beta[at])
    return np.concatenate(parts, axis=1)


def sizes(block: Block, noise: Noise) -> Array:
    """Return the size (k,) of each of the ``columns`` of a block under a noise."""
    own = 0 if block.unidentified is None else block.unidentified.shape[1]
    of_zeros = np.full(block.zeros.shape[1], noise.zero_factor)
    scatter = noise.scatter[noise.scattering] if block.role != "calibrate" else of_zeros[:0]
    return np.concatenate([scatter, of_zeros, np.ones(own)])


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


def alike(one: Noise, other: Noise) -> bool:
    """Whether two noises, one estimated from the other, are the same but for what does not count."""
    first, second = (
        np.array([*each.scatter, each.zero_factor, each.alike, *each.misfit.values(), *each.level.values()])
        for each in (one, other)
    )
    return len(first) == len(second) and bool(np.allclose(first, second, rtol=SAME, atol=0.0))
