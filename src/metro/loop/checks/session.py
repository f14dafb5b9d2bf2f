"""A scan along the order of cutting: steps and drifts that repeats in random order turn into scatter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.expectation import amplitude
from metro.loop.fitting.fit import Fit
from metro.observables.problem import Block
from metro.units import Array

PERMUTATIONS = 1999  # the least p-value is 1/2000, a tenth of the level at which a step counts
LEAST_RUNS = 6  # looked at from here on; a p-value that counts needs 11 at least


@dataclass(frozen=True)
class Step:
    """A step of a base parameter in mid-session.

    ``parameter``, ``after``: the run after which it comes, ``relative`` size, ``p_value`` over all
    parameters and places.
    """

    parameter: str
    after: str
    relative: float
    p_value: float


def scan(fitted: Fit, seed: int) -> Step | None:
    """Find the largest step of a base parameter along the session; None where the runs do not determine it.

    Each run's own deviation of each base parameter is compared with the other runs of its condition alone;
    under no change these are exchangeable, which is the null distribution: the cumulative sum in the order of
    cutting, its largest value over places and parameters, against runs permuted within their conditions.
    """
    blocks = sorted((b for b in fitted.blocks if b.role != "calibrate"), key=lambda block: block.order)
    conditions = [block.condition for block in blocks]
    groups = [np.flatnonzero(np.array(conditions) == name) for name in dict.fromkeys(conditions)]
    at = fitted.noise.scattering
    if len(blocks) < LEAST_RUNS or not len(at) or all(len(group) == 1 for group in groups):
        return None
    deviation = np.array([_deviation(fitted, block) for block in blocks])
    for group in groups:
        deviation[group] -= deviation[group].mean(axis=0)
    spread = np.sqrt(np.mean(deviation**2, axis=0))
    scaled = deviation / np.where(spread > 0.0, spread, np.inf)
    sums = _cusum(scaled)
    rng = np.random.default_rng(seed)
    drawn = np.array([_cusum(_permuted(scaled, groups, rng)).max() for _ in range(PERMUTATIONS)])
    place, parameter = np.unravel_index(int(np.argmax(sums)), sums.shape)
    relative = deviation[place + 1 :, parameter].mean() - deviation[: place + 1, parameter].mean()
    name = fitted.candidate.base.parameters[at[parameter]].name
    p_value = (1.0 + np.count_nonzero(drawn >= sums.max() - 1e-12)) / (1.0 + PERMUTATIONS)
    return Step(name, blocks[place].run, float(relative), float(p_value))


def _deviation(fitted: Fit, block: Block) -> Array:
    """Return the expected relative deviations of a run's base parameters that scatter, by its residual."""
    model = fitted.candidate.model(fitted.theta)
    matrix, offset = model.design(block, fitted.nuisance[block.run], fitted.beta)
    directions = noise_room.shared(block, fitted.noise, matrix, fitted.beta)
    residual = block.measured - offset - matrix @ fitted.beta
    deviation, _ = amplitude(directions, residual, noise_room.diagonal(block, fitted.noise))
    at = fitted.noise.scattering
    return np.asarray(deviation[: len(at)] * fitted.noise.scatter[at])


def _cusum(series: Array) -> Array:
    """Size of the cumulative sums of (runs, parameters), each place by its own standard deviation."""
    place = np.arange(1, len(series))[:, None]
    return np.asarray(np.abs(np.cumsum(series, axis=0)[:-1]) / np.sqrt(place * (len(series) - place)))


def _permuted(series: Array, groups: Sequence[np.ndarray], rng: np.random.Generator) -> Array:
    result = series.copy()
    for group in groups:
        result[group] = series[rng.permutation(group)]
    return result
